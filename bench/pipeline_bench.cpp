// What the facade costs beside the methods under it: pictures a second, and the first answer of a
// large memory file with everything that comes before it. One core.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mirror_images.hpp"
#include "panonav/core/random.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

namespace {

using namespace panonav;

std::vector<Observation> pictures() {
  std::vector<Observation> result;
  for (Image& image : images()) result.emplace_back(std::move(image));
  return result;
}

void count_pictures(benchmark::State& state) {
  state.counters["pictures/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void bare_extractor(benchmark::State& state) {
  const auto seen = pictures();
  const Unwarper unwarper(mirror_camera(), {80, 512});
  const SignatureExtractor extractor({80, 512});
  SignatureExtractor::Workspace workspace;
  std::size_t next = 0;
  for (auto _ : state) {
    const auto& image = std::get<Image>(seen[next].picture);
    benchmark::DoNotOptimize(pack(extractor.signature(unwarper, image.view(), workspace), 1.0F));
    next = (next + 1) % seen.size();
  }
  count_pictures(state);
}
BENCHMARK(bare_extractor);

void view_encoder(benchmark::State& state) {
  const auto seen = pictures();
  MemoryHeader header;
  header.source.kind = PictureKind::mirror;
  header.source.camera = mirror_camera();
  header.elevations = visible_elevations(mirror_camera());
  const ViewEncoder encoder(header, header.source);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(encoder.packed(seen[next]));
    next = (next + 1) % seen.size();
  }
  count_pictures(state);
}
BENCHMARK(view_encoder);

/// A file of views on a meander, 0.25 m apart, whose signatures walk at random; removed at the end.
class LargeFile {
 public:
  explicit LargeFile(int views)
      : path_(std::filesystem::temp_directory_path() /
              ("panonav_pipeline_bench_" + std::to_string(::getpid()) + ".panonav")) {
    MemoryHeader header;
    header.shape = {20, 15};
    header.panorama_columns = 128;
    MemoryFile file = MemoryFile::create(path_, header);
    Random random(1);
    const std::size_t size = header.shape.size();
    std::vector<double> magnitudes(size, 60.0);
    std::vector<double> phases(size, 0.0);
    std::vector<NewView> batch;
    for (int i = 0; i < views; ++i) {
      const int row = i / 400;
      const int column = row % 2 == 0 ? i % 400 : 399 - i % 400;
      NewView view;
      view.info.name = "view_" + std::to_string(i) + ".png";
      view.info.pose = ReferencePose{0.25 * column, 0.25 * row, row % 2 == 0 ? 0.0 : 3.0};
      view.signature.shape = header.shape;
      for (std::size_t k = 0; k < size; ++k) {
        magnitudes[k] = std::abs(magnitudes[k] + random.normal(0.0, 4.0));
        if (magnitudes[k] > 255.0) magnitudes[k] = 510.0 - magnitudes[k];
        phases[k] += random.normal(0.0, 6.0);
        const auto magnitude = static_cast<std::uint8_t>(magnitudes[k]);
        view.signature.magnitudes.push_back(magnitude);
        view.signature.phases.push_back(
            magnitude == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(std::lround(phases[k])));
      }
      batch.push_back(std::move(view));
      if (batch.size() == 5000 || i + 1 == views) {
        file.append(batch);
        batch.clear();
      }
    }
  }
  ~LargeFile() { std::filesystem::remove(path_); }
  LargeFile(const LargeFile&) = delete;
  LargeFile& operator=(const LargeFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

/// From the path of a file in the system's cache to the first answer; with the models that the file
/// keeps, or with models learnt anew, as for a file of an older version.
void first_answer(benchmark::State& state, bool kept) {
  const LargeFile large(static_cast<int>(state.range(0)));
  MemoryFile file = MemoryFile::open(large.path(), Access::read_write);
  if (kept) keep_models(file);
  const Image picture(128, 20);
  for (auto _ : state) {
    const PlaceRecogniser recogniser(large.path());
    benchmark::DoNotOptimize(recogniser.localise(picture).known);
  }
}
BENCHMARK_CAPTURE(first_answer, kept_models, true)->Arg(100000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first_answer, learnt_anew, false)->Arg(100000)->Unit(benchmark::kMillisecond);

}  // namespace
