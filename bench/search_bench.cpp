// Search in a memory of many views on a PostgreSQL server: search_bench fill|ask ADDRESS [VIEWS].
// bench/search_bench.sh starts a server for it. Of the views 100,000 are rendered; the others are
// made in places of 1000, each of two rendered runs of 1000 views that are mixed with one weight.
// Such places are more like each other and like every query than rendered ones.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_fleet/place_search.hpp"
#include "panonav_fleet/postgresql_memories.hpp"
#include "panonav_simulation/make_each.hpp"
#include "rivals.hpp"
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
  if (memory_exists(address)) return 0;
  MemoryFile file = MemoryFile::create(address, header);
  const auto start = Clock::now();
  std::vector<NewView> some;
  for (std::size_t number = 0; number < views; ++number) {
    some.push_back(view_of(number));
    if (some.size() < batch && number + 1 < views) continue;
    file.append(some);
    some.clear();
    if ((number + 1) % 1000000 == 0) {
      std::cerr << number + 1 << " views in " << format_fixed(seconds_since(start), 0) << " s\n";
    }
  }
  std::cout << "fill: " << views << " views in " << format_fixed(seconds_since(start), 0) << " s\n";
  return 0;
}

PackedSignature query_of(std::vector<std::uint8_t> magnitudes) {
  const std::size_t bytes = magnitudes.size();
  return {ViewSet::shape, std::move(magnitudes), std::vector<std::uint8_t>(bytes)};
}

struct Queries {
  std::string name;
  std::vector<PackedSignature> all;
};

/// None of them is in the memory.
std::vector<Queries> make_queries() {
  std::vector<Queries> kinds{{"between rendered views", {}},
                             {"mixtures of two such", {}},
                             {"another building", {}},
                             {"noise", {}}};
  const ViewSet& set = rendered_views();
  const ViewSet other = simulated_views(
      Places::rooms, 6000, 100, std::filesystem::path(PANONAV_BENCH_CACHE) / "other.bin", 5000);
  Random random(9);
  const auto bytes_of = [](std::span<const std::uint8_t> from) {
    return std::vector<std::uint8_t>(from.begin(), from.end());
  };
  for (std::size_t i = 0; i < 200; ++i) {
    kinds[0].all.push_back(query_of(bytes_of(set.query(i * 5))));
  }
  for (std::size_t i = 0; i < 40; ++i) {
    auto mixed = bytes_of(set.query(random.index(set.query_count())));
    const auto second = set.query(random.index(set.query_count()));
    for (std::size_t k = 0; k < mixed.size(); ++k) {
      mixed[k] = static_cast<std::uint8_t>((mixed[k] + second[k] + 1) / 2);
    }
    kinds[1].all.push_back(query_of(mixed));
    kinds[2].all.push_back(query_of(bytes_of(other.query(i * 2))));
  }
  for (std::size_t i = 0; i < 5; ++i) {
    std::vector<std::uint8_t> noise(ViewSet::shape.size());
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.next());
    kinds[3].all.push_back(query_of(std::move(noise)));
  }
  return kinds;
}

double gigabytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key)) return 1e-6 * std::stod(line.substr(key.size()));
  }
  return 0.0;
}

void print_load() {
  std::ifstream file("/proc/loadavg");
  std::string load;
  std::getline(file, load);
  std::cout << "load: " << load << "\n";
}

std::string times(std::vector<double> ms) {
  std::ranges::sort(ms);
  return "median " + format_fixed(ms[ms.size() / 2], 1) + ", of ten nine " +
         format_fixed(ms[ms.size() * 9 / 10], 1) + ", slowest " + format_fixed(ms.back(), 1) +
         " ms";
}

/// Measures the read bandwidth of the memory.
double read_gb_per_s() {
  std::vector<std::uint64_t> bytes(std::size_t{64} << 20U, 1);
  double best = 0.0;
  for (int i = 0; i < 5; ++i) {
    const auto start = Clock::now();
    std::array<std::uint64_t, 8> sums{};
    for (std::size_t at = 0; at < bytes.size(); at += 8) {
      for (std::size_t lane = 0; lane < 8; ++lane) sums[lane] += bytes[at + lane];
    }
    const double taken_s = seconds_since(start);
    if (std::ranges::max(sums) != 0) best = std::max(best, 8e-9 * double(bytes.size()) / taken_s);
  }
  return best;
}

/// The ten nearest of some queries by comparing all views.
std::vector<std::vector<Match>> scan(std::span<const PackedSignature* const> queries,
                                     std::size_t views) {
  std::vector<std::vector<Match>> nearest(queries.size());
  const auto before = [](const Match& a, const Match& b) {
    return std::pair(a.dissimilarity, a.view) < std::pair(b.dissimilarity, b.view);
  };
  for (std::size_t number = 0; number < views; ++number) {
    const auto view = magnitudes_of(number);
    for (std::size_t q = 0; q < queries.size(); ++q) {
      const auto& query_magnitudes = queries[q]->magnitudes;
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i < view.size(); ++i) {
        sum += static_cast<std::uint32_t>(std::abs(view[i] - query_magnitudes[i]));
      }
      auto& best = nearest[q];
      const Match match{{static_cast<std::uint32_t>(number + 1)}, sum};
      if (best.size() == 10 && !before(match, best.back())) continue;
      best.insert(std::ranges::upper_bound(best, match, before), match);
      if (best.size() > 10) best.pop_back();
    }
  }
  return nearest;
}

void ask_rivals(const std::vector<PackedSignature>& queries) {
  constexpr std::size_t held = 1000000;
  VisualMemory memory(ViewSet::shape, 1.0F, {});
  std::vector<std::uint8_t> plain;
  plain.reserve(held * ViewSet::shape.size());
  for (std::size_t number = 0; number < held; ++number) {
    PackedSignature view = query_of(magnitudes_of(number));
    plain.insert(plain.end(), view.magnitudes.begin(), view.magnitudes.end());
    memory.append(view, {"v" + std::to_string(number), {}, {}});
  }
  (void)memory.search(queries.front());
  std::vector<double> ms;
  for (const PackedSignature& query : queries) {
    const auto start = Clock::now();
    (void)memory.search(query);
    ms.push_back(1e3 * seconds_since(start));
  }
  std::cout << "VisualMemory of " << held << " views: " << times(ms) << "\n";
  const auto rival = make_byte_scan(plain, ViewSet::shape.size());
  std::vector<double> scan_ms;
  for (std::size_t i = 0; i < 5; ++i) {
    const auto start = Clock::now();
    (void)rival->nearest(queries[i].magnitudes, 10);
    scan_ms.push_back(1e3 * seconds_since(start));
  }
  std::cout << "scan over " << held << " views: " << times(scan_ms) << "\n";
}

int ask(const std::string& address, std::size_t views) {
  const std::vector<Queries> kinds = make_queries();
  print_load();
  std::cout << "memory is read with " << format_fixed(read_gb_per_s(), 1) << " GB/s\n";
  const double before = gigabytes("VmRSS:");
  const auto start = Clock::now();
  const fleet::PlaceSearch search(address);
  const double taken_s = seconds_since(start);
  std::cout << "start: " << search.size() << " views in " << format_fixed(taken_s, 1)
            << " s; sketches " << format_fixed(1e-9 * double(search.bytes()), 2) << " GB, "
            << format_fixed(double(search.bytes()) / double(search.size()), 0)
            << " bytes a view; resident " << format_fixed(gigabytes("VmRSS:") - before, 2)
            << " GB more, at most " << format_fixed(gigabytes("VmHWM:"), 2) << " GB in all\n";
  std::vector<const PackedSignature*> sampled;
  std::vector<std::vector<Match>> found;
  for (int round = 0; round < 2; ++round) {
    print_load();
    std::cout << (round == 0 ? "first time, rows from the disk:\n" : "again:\n");
    for (const Queries& kind : kinds) {
      std::vector<double> ms;
      std::vector<double> own_ms;
      std::uint64_t in_full = 0;
      std::uint64_t bytes = 0;
      for (std::size_t i = 0; i < kind.all.size(); ++i) {
        const auto from = Clock::now();
        const double own = simulation::get_thread_cpu_time_s();
        const SearchResult result = search.search(kind.all[i]);
        own_ms.push_back(1e3 * (simulation::get_thread_cpu_time_s() - own));
        ms.push_back(1e3 * seconds_since(from));
        in_full += result.views_in_full;
        bytes += result.bytes_read;
        if (round == 0 && i < 3) {
          sampled.push_back(&kind.all[i]);
          found.push_back(result.matches);
        }
      }
      std::cout << "  " << kind.name << ": " << times(ms) << "; processor time " << times(own_ms)
                << "; " << in_full / kind.all.size() << " views read in full, "
                << format_fixed(1e-6 * double(bytes) / double(kind.all.size()), 0) << " MB\n";
    }
  }
  const bool equal = scan(sampled, views) == found;
  std::cout << "equal to a full scan over " << views << " views in " << sampled.size()
            << " samples: " << (equal ? "yes" : "NO") << "\n";
  ask_rivals(kinds.front().all);
  return equal ? 0 : 1;
}

}  // namespace
}  // namespace panonav::bench

int main(int argc, char** argv) {
  using namespace panonav::bench;
  std::cout << std::unitbuf;
  panonav::fleet::register_postgresql_memories();
  const std::string what = argc > 2 ? argv[1] : "";
  const std::size_t views = argc > 3 ? std::stoul(argv[3]) : 10000000;
  if (what == "fill") return fill(argv[2], views);
  if (what == "ask") return ask(argv[2], views);
  std::cerr << "usage: search_bench fill|ask ADDRESS [VIEWS], as of panonav-postgresql FOLDER "
               "address search\n";
  return 2;
}
