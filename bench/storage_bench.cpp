// Measures loading and growing of a memory file.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/storage/memory_file.hpp"

namespace {

using namespace panonav;

MemoryHeader header() {
  MemoryHeader header;
  header.shape = {80, 15};
  return header;
}

NewView random_view(Random& random, int number) {
  NewView view;
  view.info.name = "view_" + std::to_string(number) + ".png";
  view.info.pose = ReferencePose{0.1 * number, -0.1 * number, 0.5};
  view.signature = {header().shape, std::vector<std::uint8_t>(header().shape.size()),
                    std::vector<std::uint8_t>(header().shape.size())};
  for (auto* part : {&view.signature.magnitudes, &view.signature.phases}) {
    for (auto& value : *part) value = static_cast<std::uint8_t>(random.next());
  }
  return view;
}

// A memory file of its own for each run of the program, removed at its end.
class BenchFile {
 public:
  explicit BenchFile(int views)
      : path_(std::filesystem::temp_directory_path() /
              ("panonav_storage_bench_" + std::to_string(::getpid()) + ".panonav")) {
    MemoryFile file = MemoryFile::create(path_, header());
    Random random(1);
    for (int number = 0; number < views;) {
      std::vector<NewView> batch;
      for (; number < views && batch.size() < 5000; ++number) {
        batch.push_back(random_view(random, number));
      }
      file.append(batch);
    }
  }
  ~BenchFile() { std::filesystem::remove(path_); }
  BenchFile(const BenchFile&) = delete;
  BenchFile& operator=(const BenchFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

// Opening, checking every view and building the memory with its search structure. The file is in
// the system's cache.
void load(benchmark::State& state) {
  const BenchFile file(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const VisualMemory memory = MemoryFile::open(file.path(), Access::read_only).load();
    benchmark::DoNotOptimize(memory.size());
  }
  state.counters["views"] = static_cast<double>(state.range(0));
  state.counters["file_MB"] = static_cast<double>(std::filesystem::file_size(file.path())) / 1e6;
}
BENCHMARK(load)->Arg(1000)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
