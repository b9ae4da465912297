// Measures reading and writing of recordings. Set TMPDIR to a folder in memory (/dev/shm), or
// writing is as fast as the disk. Beside it, what `node tests/io/mcap_core.mjs speed FILE` says of
// the reference library.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav_recordings/mcap_writer.hpp"
#include "panonav_recordings/recording.hpp"

namespace {

using namespace panonav;

constexpr int pictures = 3000;
constexpr std::size_t picture_bytes = 100'000;

std::filesystem::path bench_path() {
  return std::filesystem::temp_directory_path() /
         ("panonav_recording_bench_" + std::to_string(::getpid()) + ".mcap");
}

// Pictures as a JPEG camera gives them: they cannot be packed further.
void write_pictures(recordings::McapCompression compression) {
  static const std::vector<std::uint8_t> noise = [] {
    Random random(1);
    std::vector<std::uint8_t> bytes(64 * picture_bytes);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    return bytes;
  }();
  recordings::McapWriter writer(bench_path(), {.compression = compression});
  const auto channel = writer.add_channel("/pictures", "cdr", 0);
  for (int i = 0; i < pictures; ++i) {
    writer.write(channel, i, i, std::span(noise).subspan(i % 64 * picture_bytes, picture_bytes));
  }
  writer.close();
}

void set_speed(benchmark::State& state) {
  state.SetBytesProcessed(state.iterations() * pictures * static_cast<std::int64_t>(picture_bytes));
}

void write(benchmark::State& state) {
  for (auto _ : state) write_pictures(static_cast<recordings::McapCompression>(state.range(0)));
  set_speed(state);
  std::filesystem::remove(bench_path());
}

void read(benchmark::State& state) {
  write_pictures(static_cast<recordings::McapCompression>(state.range(0)));
  const std::vector<std::uint32_t> topics{0};
  for (auto _ : state) {
    std::uint64_t sum = 0;
    recordings::Recording::open(bench_path())
        ->for_each(topics, {},
                   [&](const recordings::MessageLocation&, auto bytes) { sum += bytes.size(); });
    if (sum != pictures * picture_bytes) state.SkipWithError("messages are missing");
  }
  set_speed(state);
  std::filesystem::remove(bench_path());
}

// Argument: McapCompression.
BENCHMARK(read)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(write)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
