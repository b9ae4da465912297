// Measures memories on a PostgreSQL server: server_bench ADDRESS, without the parameter
// `memory`. Uploads 50,000 views of 80 x 15 in transactions of 1000, then reads areas of 200 views.
// bench/server_bench.sh starts a server for it and keeps both on one core.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_fleet/postgresql_memories.hpp"

namespace {

using namespace panonav;
using Clock = std::chrono::steady_clock;

constexpr int views = 50000;
constexpr int batch = 1000;
constexpr int per_row = 250;  // on a grid of 0.7 m: 204 of 10 m x 10 m

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double processor_seconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

NewView random_view(Random& random, SignatureShape shape, int number) {
  NewView view;
  view.info.name = "view_" + std::to_string(number) + ".png";
  view.info.pose = ReferencePose{0.7 * (number % per_row), 0.7 * (number / per_row), 0.5};
  view.signature = {shape, std::vector<std::uint8_t>(shape.size()),
                    std::vector<std::uint8_t>(shape.size())};
  for (auto* part : {&view.signature.magnitudes, &view.signature.phases}) {
    for (auto& value : *part) value = static_cast<std::uint8_t>(random.next());
  }
  return view;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: server_bench ADDRESS, as of panonav-postgresql FOLDER address bench\n";
    return 2;
  }
  fleet::register_postgresql_memories();
  MemoryHeader header;
  header.shape = {80, 15};
  MemoryFile file = MemoryFile::create(argv[1], header);
  Random random(1);
  double upload_s = 0.0;
  double own_s = 0.0;
  for (int number = 0; number < views;) {
    std::vector<NewView> some;
    for (int i = 0; i < batch; ++i) some.push_back(random_view(random, header.shape, number++));
    const auto start = Clock::now();
    const double before = processor_seconds();
    file.append(some);
    upload_s += seconds_since(start);
    own_s += processor_seconds() - before;
  }
  std::cout << "upload: " << format_fixed(views / upload_s, 0) << " views a second by the clock, "
            << format_fixed(1e6 * own_s / views, 1) << " us a view of this process\n";

  std::vector<double> times_ms;
  std::size_t read = 0;
  for (int i = 0; i < 101; ++i) {
    const double x_m = random.uniform(0.0, 150.0);
    const double y_m = random.uniform(0.0, 120.0);
    const auto start = Clock::now();
    const auto ids = file.views_within({x_m, x_m + 9.9, y_m, y_m + 9.9});
    read += file.load(ids).size();
    times_ms.push_back(1e3 * seconds_since(start));
  }
  std::ranges::sort(times_ms);
  std::cout << "area: " << read / times_ms.size() << " views in " << format_fixed(times_ms[50], 2)
            << " ms (median), " << format_fixed(times_ms.back(), 2) << " ms (slowest of 101)\n";

  std::vector<double> append_ms;
  for (int i = 0; i < 200; ++i) {
    const NewView view = random_view(random, header.shape, views + i);
    const auto start = Clock::now();
    file.append(view);
    append_ms.push_back(1e3 * seconds_since(start));
  }
  std::ranges::sort(append_ms);
  std::cout << "append: one view in " << format_fixed(append_ms[100], 2) << " ms (median)\n";
  const auto start = Clock::now();
  const std::size_t loaded = file.load().size();
  std::cout << "load: " << format_fixed(static_cast<double>(loaded) / seconds_since(start), 0)
            << " views a second\n";
}
