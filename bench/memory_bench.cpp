// The nearest 10 of many views, exactly: VisualMemory against plain scans, FAISS and hnswlib.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "panonav/memory/visual_memory.hpp"
#include "rivals.hpp"
#include "simulated_views.hpp"

namespace panonav::bench {
namespace {

constexpr std::size_t top = 10;
constexpr std::size_t full_size = 100000;

PackedSignature to_packed(std::span<const std::uint8_t> magnitudes) {
  return {ViewSet::shape,
          {magnitudes.begin(), magnitudes.end()},
          std::vector<std::uint8_t>(magnitudes.size(), 0)};
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  statm >> total >> resident;
  return resident * 4096.0;
}

struct Built {
  VisualMemory memory{ViewSet::shape, 1.0F, {}};
  double append_s = 0.0;
  double slowest_append_s = 0.0;
  double resident_bytes = 0.0;
};

/// `size` views of the set. Beyond the end of the set it starts again with other rooms: the rows of
/// all views are turned round by 8, 16, .., which keeps how views of one room lie to each other.
Built build(const ViewSet& set, std::size_t size) {
  Built built;
  const double before = resident_bytes();
  for (std::size_t i = 0; i < size; ++i) {
    PackedSignature view = to_packed(set.view(i % set.size()));
    const auto turned = static_cast<std::ptrdiff_t>(i / set.size() * 8 % ViewSet::shape.rows);
    for (int k = 0; k < ViewSet::shape.components; ++k) {
      const auto first = view.magnitudes.begin() + k * ViewSet::shape.rows;
      std::rotate(first, first + turned, first + ViewSet::shape.rows);
    }
    ReferenceInfo info{"view_" + std::to_string(i) + ".png", ReferencePose{}, {}};
    const auto start = std::chrono::steady_clock::now();
    built.memory.append(view, std::move(info));
    const double took =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    built.append_s += took;
    built.slowest_append_s = std::max(built.slowest_append_s, took);
  }
  built.resident_bytes = resident_bytes() - before;
  return built;
}

/// The benchmark library calls a body several times to find out how often to repeat it; what is
/// slow to make is kept until the next benchmark makes something else.
template <class T>
T& kept(const std::string& key, const std::function<std::unique_ptr<T>()>& make) {
  static std::string key_of_last;
  static std::unique_ptr<T> last;
  if (key != key_of_last) {
    last.reset();
    last = make();
    key_of_last = key;
  }
  return *last;
}

std::vector<PackedSignature> queries_for(const ViewSet& set, std::size_t size) {
  const std::size_t count =
      std::max<std::size_t>(1, set.query_count() * std::min(size, set.size()) / set.size());
  std::vector<PackedSignature> queries;
  for (std::size_t i = 0; i < count; ++i) queries.push_back(to_packed(set.query(i)));
  return queries;
}

void time_memory(benchmark::State& state, const std::string& name, const ViewSet& set,
                 std::size_t size) {
  const Built& built = kept<Built>(name + std::to_string(size),
                                   [&] { return std::make_unique<Built>(build(set, size)); });
  const std::vector<PackedSignature> queries = queries_for(set, size);
  double bytes = 0.0;
  double in_full = 0.0;
  std::size_t i = 0;
  for (auto _ : state) {
    const SearchResult found = built.memory.search(queries[i++ % queries.size()], {top, 0});
    benchmark::DoNotOptimize(found.matches.data());
    bytes += static_cast<double>(found.bytes_read);
    in_full += static_cast<double>(found.views_in_full);
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["bytes"] = bytes / runs;
  state.counters["share"] = bytes / runs / (1200.0 * static_cast<double>(size));
  state.counters["in_full"] = in_full / runs;
  state.counters["append_us"] = built.append_s * 1e6 / static_cast<double>(size);
  state.counters["slowest_append_ms"] = built.slowest_append_s * 1e3;
  state.counters["resident_per_view"] = built.resident_bytes / static_cast<double>(size);
}

std::uint32_t distance(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += static_cast<std::uint32_t>(std::abs(a[i] - b[i]));
  }
  return sum;
}

/// Share of the found views that are no further away than the 10th exact one (ties count as found).
double recall(const ViewSet& set, Rival& rival, std::size_t queries,
              const std::vector<std::uint32_t>& tenth) {
  std::size_t right = 0;
  for (std::size_t q = 0; q < queries; ++q) {
    for (const std::uint32_t view : rival.nearest(set.query(q), top)) {
      right += distance(set.query(q), set.view(view)) <= tenth[q] ? 1 : 0;
    }
  }
  return static_cast<double>(right) / static_cast<double>(queries * top);
}

std::vector<std::uint32_t> tenth_distances(const ViewSet& set, std::size_t queries) {
  const Built built = build(set, set.size());
  std::vector<std::uint32_t> tenth;
  for (std::size_t q = 0; q < queries; ++q) {
    const auto found = built.memory.search(to_packed(set.query(q)), {top, 0});
    tenth.push_back(found.matches.back().dissimilarity);
  }
  return tenth;
}

void time_rival(benchmark::State& state, const ViewSet& set, Rival& rival, double ef) {
  constexpr std::size_t checked = 20;
  const double found = recall(set, rival, checked, tenth_distances(set, checked));
  if (ef == 0.0 && found < 1.0) {
    state.SkipWithError("found other views than VisualMemory");
    return;
  }
  std::size_t i = 0;
  for (auto _ : state) {
    const auto nearest = rival.nearest(set.query(i++ % set.query_count()), top);
    benchmark::DoNotOptimize(nearest.data());
  }
  if (ef > 0.0) state.counters["ef"] = ef;
}

/// The smallest of 10, 20, 40, .. at which every query finds all its 10 nearest; 0: none up to
/// 20480.
std::size_t exact_ef(const ViewSet& set, GraphRival& graph) {
  const std::vector<std::uint32_t> tenth = tenth_distances(set, set.query_count());
  for (std::size_t ef = 10; ef <= 20480; ef *= 2) {
    graph.set_ef(ef);
    const double found = recall(set, graph, set.query_count(), tenth);
    std::fprintf(stderr, "hnswlib: ef %zu, recall@10 %.5f\n", ef, found);
    if (found >= 1.0) return ef;
  }
  return 0;
}

/// A rival; null if it is not installed.
struct KeptRival {
  std::unique_ptr<Rival> rival;
  std::size_t ef = 0;
};

KeptRival make_exact_graph(const ViewSet& set, const std::string& cache) {
  auto graph = make_hnsw(set.views, ViewSet::shape.size(), cache.c_str());
  if (graph == nullptr) return {};
  const std::size_t ef = exact_ef(set, *graph);
  if (ef > 0) graph->set_ef(ef);
  return {std::move(graph), ef};
}

void time_kept(benchmark::State& state, const std::string& key, const ViewSet& set,
               const std::function<KeptRival()>& make, bool approximate) {
  const KeptRival& kept_rival =
      kept<KeptRival>(key, [&] { return std::make_unique<KeptRival>(make()); });
  if (kept_rival.rival == nullptr) {
    state.SkipWithError("not installed");
  } else if (approximate && kept_rival.ef == 0) {
    state.SkipWithError("recall 1.0 was not reached");
  } else {
    time_rival(state, set, *kept_rival.rival, static_cast<double>(kept_rival.ef));
  }
}

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const std::filesystem::path folder = PANONAV_BENCH_CACHE;
  std::filesystem::create_directories(folder);
  static const std::vector<std::pair<std::string, ViewSet>> sets = [&] {
    std::vector<std::pair<std::string, ViewSet>> made;
    made.emplace_back("rooms",
                      simulated_views(Places::rooms, full_size, 1000, folder / "rooms.bin"));
    made.emplace_back("paths",
                      simulated_views(Places::paths, full_size, 1000, folder / "paths.bin"));
    made.emplace_back("numbers", simulated_views(Places::numbers, full_size, 100, {}));
    return made;
  }();
  const auto add = [](const std::string& name, std::function<void(benchmark::State&)> body) {
    benchmark::RegisterBenchmark(name.c_str(), std::move(body))->Unit(benchmark::kMillisecond);
  };
  const auto add_rival = [&add](const std::string& name, const ViewSet& set, bool approximate,
                                std::function<KeptRival()> make) {
    add(name + "/100000", [name, &set, approximate, make](benchmark::State& state) {
      time_kept(state, name, set, make, approximate);
    });
  };
  for (const auto& [name, set] : sets) {
    for (const std::size_t size : {1000, 10000, 100000, 1000000}) {
      add("memory/" + name + "/" + std::to_string(size),
          [&name = name, &set = set, size](benchmark::State& state) {
            time_memory(state, name, set, size);
          });
    }
    add_rival("float_scan/" + name, set, false, [&set = set] {
      return KeptRival{make_float_scan(set.views, ViewSet::shape.size())};
    });
    add_rival("byte_scan/" + name, set, false,
              [&set = set] { return KeptRival{make_byte_scan(set.views, ViewSet::shape.size())}; });
  }
  const ViewSet& rooms = sets.front().second;
  add_rival("faiss_flat/rooms", rooms, false,
            [&rooms] { return KeptRival{make_faiss(rooms.views, ViewSet::shape.size())}; });
  add_rival("hnswlib/rooms", rooms, true,
            [&rooms, folder] { return make_exact_graph(rooms, (folder / "rooms.hnsw").string()); });
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace panonav::bench

int main(int argc, char** argv) {
  return panonav::bench::run(argc, argv);
}
