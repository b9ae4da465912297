// Measures the facade: images per second, and the first answer of a large memory file with its
// preparation. One core.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mirror_images.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"

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

/// A folder of its own under the system's folder for temporary files; removed at the end.
class Folder {
 public:
  explicit Folder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() /
              ("panonav_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

/// Reading one PNG of 640 x 480 from the system's cache: the share of decoding end to end.
void decode(benchmark::State& state) {
  const Folder folder("decode");
  std::vector<std::filesystem::path> paths;
  for (const Image& image : images()) {
    paths.push_back(folder.path() / (std::to_string(paths.size()) + ".png"));
    write_png(paths.back(), image.view());
  }
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_image(paths[next]));
    next = (next + 1) % paths.size();
  }
  count_pictures(state);
}
BENCHMARK(decode);

/// Decoded pictures into a new memory file, as the command adds them: 16 in a transaction, and the
/// models learnt at the end.
void memorise(benchmark::State& state, bool thumbnails) {
  constexpr std::size_t views = 256;
  constexpr std::size_t batch = 16;
  const Folder folder("memorise");
  const auto seen = pictures();
  Executor executor(1);
  for (auto _ : state) {
    const auto path = folder.path() / "memory.panonav";
    std::filesystem::remove(path);
    MemoriserOptions options{
        .source = PictureSource{}, .thumbnails = thumbnails, .features = false};
    options.source->kind = PictureKind::mirror;
    options.source->camera = mirror_camera();
    Memoriser memoriser(path, options);
    for (std::size_t first = 0; first < views; first += batch) {
      std::vector<Observation> observations;
      for (std::size_t i = first; i < first + batch; ++i) {
        observations.push_back(seen[i % seen.size()]);
        observations.back().name = std::to_string(i);
      }
      memoriser.add(std::move(observations), executor);
    }
    memoriser.finish(executor);
  }
  state.counters["pictures/s"] = benchmark::Counter(static_cast<double>(state.iterations() * views),
                                                    benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(memorise, signatures, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(memorise, signatures_and_thumbnails, true)->Unit(benchmark::kMillisecond);

/// A decoded picture to a place in a memory of 1,000 views.
void localise(benchmark::State& state) {
  const Folder folder("localise");
  const auto path = folder.path() / "memory.panonav";
  const auto seen = pictures();
  {
    MemoriserOptions options{.source = PictureSource{}, .thumbnails = false, .features = false};
    options.source->kind = PictureKind::mirror;
    options.source->camera = mirror_camera();
    Memoriser memoriser(path, options);
    Executor executor(1);
    std::vector<Observation> observations;
    for (int i = 0; i < 1000; ++i) {
      observations.push_back(seen[static_cast<std::size_t>(i) % seen.size()]);
      observations.back().name = std::to_string(i);
      observations.back().pose = ReferencePose{0.25 * (i % 40), 0.25 * (i / 40), 0.0};
    }
    memoriser.add(std::move(observations), executor);
    memoriser.finish(executor);
  }
  const PlaceRecogniser recogniser(path);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(recogniser.localise(seen[next]).known);
    next = (next + 1) % seen.size();
  }
  count_pictures(state);
}
BENCHMARK(localise);

/// A file of views on a meander, 0.25 m apart, whose signatures walk at random; removed at the end.
class LargeFile {
 public:
  explicit LargeFile(int views) : folder_("large"), path_(folder_.path() / "memory.panonav") {
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
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  Folder folder_;
  std::filesystem::path path_;
};

/// Measures the time from a file in the system's cache to the first answer, with the models of the
/// file or with models learnt again.
void first_answer(benchmark::State& state, bool kept) {
  const LargeFile large(static_cast<int>(state.range(0)));
  MemoryFile file = MemoryFile::open(large.path(), Access::read_write);
  if (kept) learn_and_store_models(file);
  const Image picture(128, 20);
  for (auto _ : state) {
    const PlaceRecogniser recogniser(large.path());
    benchmark::DoNotOptimize(recogniser.localise(picture).known);
  }
}
BENCHMARK_CAPTURE(first_answer, kept_models, true)->Arg(100000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first_answer, learnt_anew, false)->Arg(100000)->Unit(benchmark::kMillisecond);

}  // namespace
