// Measures planning and a step over 10,000 references in 50 rooms, and the memory that they use.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/area_planner.hpp"
#include "panonav/navigation/navigator.hpp"
#include "panonav/navigation/search_whole_memory.hpp"
#include "panonav/storage/memory_file_views.hpp"
#include "support/fifty_rooms.hpp"

namespace {

using namespace panonav;

const NavigationGraph& graph() {
  static const NavigationGraph rooms = testing::graph_of_rooms();
  return rooms;
}

const AreaPlanner& planner() {
  static const AreaPlanner made(graph());
  return made;
}

const VisualMemory& memory() {
  static const VisualMemory views = testing::memory_of(graph().size());
  return views;
}

// The same memory as a file, removed at the end of the program.
class BenchFile {
 public:
  BenchFile()
      : path_(std::filesystem::temp_directory_path() /
              ("panonav_navigation_bench_" + std::to_string(::getpid()) + ".panonav")) {
    MemoryHeader header;
    header.shape = memory().shape();
    header.full_scale = memory().full_scale();
    MemoryFile file = MemoryFile::create(path_, header);
    std::vector<NewView> views;
    for (const ViewId view : memory().views()) {
      views.push_back({memory().info(view), memory().packed(view), {}});
    }
    static_cast<void>(file.append(views));
  }
  ~BenchFile() {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::filesystem::remove(path_.string() + suffix, ignored);
    }
  }
  BenchFile(const BenchFile&) = delete;
  BenchFile& operator=(const BenchFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::unique_ptr<ViewSource> source(bool from_file) {
  if (!from_file) return std::make_unique<MemoryViewSource>(memory());
  static const BenchFile file;
  return std::make_unique<MemoryFileViews>(file.path());
}

void divide_into_areas(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(AreaPlanner(graph()));
  state.counters["areas"] = static_cast<double>(planner().areas().nodes.size());
}
BENCHMARK(divide_into_areas)->Unit(benchmark::kMillisecond);

// A goal, and the directions in the area of the robot.
void plan(benchmark::State& state) {
  AreaPlanner planning = planner();
  Random random(3);
  for (auto _ : state) {
    planning.set_goal(graph().view(random.index(graph().size())));
    benchmark::DoNotOptimize(planning.field(random.index(planning.areas().nodes.size())));
  }
}
BENCHMARK(plan)->Unit(benchmark::kMillisecond);

// An edge on the way is found shut: the way around it.
void plan_around(benchmark::State& state) {
  AreaPlanner planning = planner();
  planning.set_goal(graph().view(graph().size() - 1));
  Random random(3);
  for (auto _ : state) {
    const std::size_t node = random.index(graph().size());
    const std::size_t area = planning.areas().area_of[node];
    const std::size_t shut = graph().exits(node).front().edge;
    planning.block({&shut, 1});
    benchmark::DoNotOptimize(planning.field(area));
    state.PauseTiming();
    planning.unblock_all();
    state.ResumeTiming();
  }
}
BENCHMARK(plan_around)->Unit(benchmark::kMillisecond);

// Looks along the way through all rooms. `border`: those at which another area is loaded.
// `all`: every component is compared everywhere.
void look(benchmark::State& state, bool border, bool from_file, bool all = false) {
  const auto views = source(from_file);
  AreaPlanner planning = planner();
  planning.set_goal(graph().view(graph().size() - 1));
  const auto way = planning.plan_path(0);
  std::vector<FourierSignature> seen;
  for (const std::size_t node : way) seen.push_back(memory().signature(graph().view(node)));
  NavigatorOptions options;
  if (all) options.coarse_components = 0;
  Navigator navigator(*views, planner(), options);
  double bytes_read = 0.0;
  std::size_t next = way.size();
  std::size_t max_loaded = 0;
  for (auto _ : state) {
    for (bool measured = false; !measured;) {
      if (next >= way.size()) {
        navigator.set_goal(graph().view(graph().size() - 1));
        navigator.forget_place();
        next = 0;
      }
      const auto begin = std::chrono::steady_clock::now();
      const NavigationDecision decision = navigator.observe(seen[next++]);
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
      const auto had = [&](NavigationDecision::Event event) {
        return std::ranges::find(decision.events, event) != decision.events.end();
      };
      measured = !had(NavigationDecision::Event::relocalised) &&
                 had(NavigationDecision::Event::entered_area) == border;
      if (measured) {
        state.SetIterationTime(passed.count());
        bytes_read += static_cast<double>(decision.bytes_read);
      }
      max_loaded = std::max(max_loaded, navigator.loaded_view_count());
    }
  }
  state.counters["kB_read"] =
      benchmark::Counter(bytes_read / 1000.0, benchmark::Counter::kAvgIterations);
  state.counters["max_loaded_views"] = static_cast<double>(max_loaded);
  state.counters["max_loaded_kB"] =
      static_cast<double>(max_loaded * 2 * memory().shape().size()) / 1000.0;
}
BENCHMARK_CAPTURE(look, within_an_area, false, false)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(look, within_an_area_all_components, false, false, true)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(look, at_a_border, true, false)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(look, at_a_border_from_file, true, true)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

// The place is looked for in the whole memory, area by area.
void relocalise(benchmark::State& state, bool from_file) {
  const auto views = source(from_file);
  Random random(3);
  for (auto _ : state) {
    const ViewId view = graph().view(random.index(graph().size()));
    benchmark::DoNotOptimize(
        search_whole_memory(*views, graph(), planner().areas(), memory().signature(view)));
  }
}
BENCHMARK_CAPTURE(relocalise, from_memory, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(relocalise, from_file, true)->Unit(benchmark::kMillisecond);

}  // namespace
