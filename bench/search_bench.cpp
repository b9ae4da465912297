// Search in a memory of many views on a PostgreSQL server: search_bench fill|ask ADDRESS [VIEWS].
// bench/search_bench.sh starts a server for it. Of the views 100,000 are rendered; the others are
// made in places of 1000, each of two rendered runs of 1000 views that are mixed with one weight.
// Such places are more like each other and like every query than rendered ones.
#include <chrono>
#include <iostream>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_file.hpp"
#include "simulated_views.hpp"

namespace panonav::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t rendered = 100000;
constexpr std::size_t place_views = 1000;
constexpr std::size_t batch = 10000;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

const ViewSet& rendered_views() {
  static const ViewSet set = [] {
    std::filesystem::create_directories(PANONAV_BENCH_CACHE);
    return simulated_views(Places::rooms, rendered, 1000,
                           std::filesystem::path(PANONAV_BENCH_CACHE) / "rooms.bin");
  }();
  return set;
}

/// Two runs of rendered views and how much of the first is in the mixture, in 256th.
struct Mixture {
  explicit Mixture(std::size_t place) {
    Random random(place + 1);
    first = random.index(rendered - place_views);
    second = random.index(rendered - place_views);
    weight = 77 + static_cast<int>(random.index(103));
  }
  std::size_t first, second;
  int weight;
};

std::vector<std::uint8_t> magnitudes_of(std::size_t view) {
  const ViewSet& set = rendered_views();
  if (view < rendered) {
    const auto made = set.view(view);
    return {made.begin(), made.end()};
  }
  const Mixture mixture(view / place_views);
  const auto a = set.view(mixture.first + view % place_views);
  const auto b = set.view(mixture.second + view % place_views);
  std::vector<std::uint8_t> mixed(a.size());
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    mixed[i] = static_cast<std::uint8_t>(
        (a[i] * mixture.weight + b[i] * (256 - mixture.weight) + 128) / 256);
  }
  return mixed;
}

/// Each place fills a square of 10 m with a grid of 0.3 m.
NewView view_of(std::size_t number) {
  constexpr std::size_t side = 32;
  const std::size_t place = number / place_views;
  const std::size_t at = number % place_views;
  NewView view;
  view.info.name = "v" + std::to_string(number);
  view.info.pose = ReferencePose{
      10.0 * static_cast<double>(place % 100) + 0.3 * static_cast<double>(at % side),
      10.0 * static_cast<double>(place / 100) + 0.3 * static_cast<double>(at / side), 0.5};
  view.signature = {ViewSet::shape, magnitudes_of(number),
                    std::vector<std::uint8_t>(ViewSet::shape.size())};
  Random random(number + 1);
  for (auto& phase : view.signature.phases) phase = static_cast<std::uint8_t>(random.next());
  return view;
}

int fill(const std::string& address, std::size_t views) {
  MemoryHeader header;
  header.shape = ViewSet::shape;
  MemoryFile file = MemoryFile::create(address, header);
  const auto start = Clock::now();
  std::vector<NewView> some;
  for (std::size_t number = 0; number < views; ++number) {
    some.push_back(view_of(number));
    if (some.size() < batch && number + 1 < views) continue;
    file.append(some);
    some.clear();
    if ((number + 1) % 1000000 == 0) {
      std::cerr << number + 1 << " views in " << fixed(seconds_since(start), 0) << " s\n";
    }
  }
  std::cout << "fill: " << views << " views in " << fixed(seconds_since(start), 0) << " s\n";
  return 0;
}

}  // namespace
}  // namespace panonav::bench

int main(int argc, char** argv) {
  using namespace panonav::bench;
  const std::string what = argc > 2 ? argv[1] : "";
  const std::size_t views = argc > 3 ? std::stoul(argv[3]) : 10000000;
  if (what == "fill") return fill(argv[2], views);
  std::cerr << "usage: search_bench fill|ask ADDRESS [VIEWS], as of panonav-postgresql FOLDER "
               "address search\n";
  return 2;
}
