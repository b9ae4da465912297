// From a mirror image to a packed signature, and its steps; the compass. Rival: OpenCV's remap
// (tables in its fast fixed-point form) plus dft, of the same sizes. One core.

#include <benchmark/benchmark.h>

#include <cmath>
#include <optional>
#include <vector>

#include "mirror_images.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/polar.hpp"
#include "panonav/kernels/row_transform.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav/signature/signature_extractor.hpp"

#ifdef PANONAV_HAS_OPENCV
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#endif

namespace {

using namespace panonav;

constexpr int rows = 80;
constexpr int columns = 512;
constexpr int components = 15;

void count_images(benchmark::State& state) {
  state.counters["images/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void image_to_packed_signature(benchmark::State& state, const PreprocessingOptions& preprocessing) {
  const auto views = images();
  const Unwarper unwarper(mirror_camera(), {rows, columns});
  const SignatureExtractor extractor({rows, columns}, components, preprocessing);
  SignatureExtractor::Workspace workspace;
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        pack(extractor.signature(unwarper, views[next].view(), workspace), 1.0F));
    next = (next + 1) % views.size();
  }
  count_images(state);
}
BENCHMARK_CAPTURE(image_to_packed_signature, plain,
                  PreprocessingOptions{.remove_mean = false, .normalise_gain = false});
BENCHMARK_CAPTURE(image_to_packed_signature, mean_and_gain, PreprocessingOptions{});

void unwrap(benchmark::State& state, const Camera& camera) {
  const auto views = images(camera.image_size);
  const Unwarper unwarper(camera, {rows, columns, visible_elevations(mirror_camera())});
  Unwarper::Workspace workspace;
  std::size_t next = 0;
  for (auto _ : state) {
    float sum = 0.0F;
    unwarper.unwrap_blocks(views[next].view(), workspace,
                           [&](int, std::span<const float> values) { sum += values[0]; });
    benchmark::DoNotOptimize(sum);
    next = (next + 1) % views.size();
  }
  count_images(state);
}
BENCHMARK_CAPTURE(unwrap, mirror, mirror_camera());
BENCHMARK_CAPTURE(unwrap, two_lenses, dual_fisheye_camera());

void level(benchmark::State& state) {
  const Unwarper unwarper(mirror_camera(), {rows, columns});
  const Panorama seen = unwarper.unwrap(images()[0].view());
  for (auto _ : state) benchmark::DoNotOptimize(level_panorama(seen, {0.03, -0.04}));
  count_images(state);
}
BENCHMARK(level);

Panorama random_panorama(std::uint64_t seed) {
  Random random(seed);
  Panorama panorama(rows, columns, std::nullopt);
  for (float& value : panorama.values()) value = static_cast<float>(random.uniform());
  return panorama;
}

void panorama_to_signature(benchmark::State& state) {
  const Panorama panorama = random_panorama(1);
  const kernels::RowTransform transform(columns, components);
  for (auto _ : state) benchmark::DoNotOptimize(compute_signature(panorama, transform));
  count_images(state);
}
BENCHMARK(panorama_to_signature);

void row_transform(benchmark::State& state) {
  const Panorama panorama = random_panorama(1);
  const kernels::RowTransform transform(columns, static_cast<int>(state.range(0)));
  std::vector<float> real(static_cast<std::size_t>(rows) * transform.components());
  std::vector<float> imaginary(real.size());
  for (auto _ : state) {
    transform(panorama.values(), real, imaginary, rows, kernels::chosen_instructions());
    benchmark::DoNotOptimize(real.data());
    benchmark::ClobberMemory();
  }
  count_images(state);
}
BENCHMARK(row_transform)->Arg(15)->Arg(50)->Arg(256);

void compass_float(benchmark::State& state) {
  const FourierSignature query = compute_signature(random_panorama(1), components);
  const FourierSignature reference = compute_signature(random_panorama(2), components);
  for (auto _ : state) benchmark::DoNotOptimize(compass(query, reference));
}
BENCHMARK(compass_float);

void compass_packed(benchmark::State& state) {
  const PackedSignature query = pack(compute_signature(random_panorama(1), components), 1.0F);
  const PackedSignature reference = pack(compute_signature(random_panorama(2), components), 1.0F);
  for (auto _ : state) benchmark::DoNotOptimize(compass(query, reference));
}
BENCHMARK(compass_packed);

#ifdef PANONAV_HAS_OPENCV
/// remap with linear interpolation, no anti-aliasing, to 80 x 512; conversion to float; dft of
/// every row. What a signature needs beyond that (magnitudes, phases, packing) is not counted.
void opencv_remap_and_dft(benchmark::State& state) {
  cv::setNumThreads(1);
  const auto views = images();
  const Camera camera = mirror_camera();
  const Panorama angles(rows, columns, visible_elevations(camera));
  cv::Mat map_u(rows, columns, CV_32F);
  cv::Mat map_v(rows, columns, CV_32F);
  for (int y = 0; y < rows; ++y) {
    for (int c = 0; c < columns; ++c) {
      const auto point =
          project(camera, Direction3::from_angles(angles.azimuth_rad(c), angles.elevation_rad(y)));
      map_u.at<float>(y, c) = point ? static_cast<float>(point->u_px - 0.5) : 0.0F;
      map_v.at<float>(y, c) = point ? static_cast<float>(point->v_px - 0.5) : 0.0F;
    }
  }
  cv::Mat fixed_1, fixed_2;
  cv::convertMaps(map_u, map_v, fixed_1, fixed_2, CV_16SC2);
  cv::Mat panorama, values, spectrum;
  std::size_t next = 0;
  for (auto _ : state) {
    const Image& view = views[next];
    const cv::Mat image(480, 640, CV_8U, const_cast<std::uint8_t*>(view.pixels().data()));
    cv::remap(image, panorama, fixed_1, fixed_2, cv::INTER_LINEAR);
    panorama.convertTo(values, CV_32F, 1.0 / 255.0);
    cv::dft(values, spectrum, cv::DFT_ROWS);
    benchmark::DoNotOptimize(spectrum.data);
    benchmark::ClobberMemory();
    next = (next + 1) % views.size();
  }
  count_images(state);
}
BENCHMARK(opencv_remap_and_dft);

void opencv_dft(benchmark::State& state) {
  cv::setNumThreads(1);
  const Panorama panorama = random_panorama(1);
  const cv::Mat values(rows, columns, CV_32F, const_cast<float*>(panorama.values().data()));
  cv::Mat spectrum;
  for (auto _ : state) {
    cv::dft(values, spectrum, cv::DFT_ROWS);
    benchmark::DoNotOptimize(spectrum.data);
    benchmark::ClobberMemory();
  }
  count_images(state);
}
BENCHMARK(opencv_dft);
#endif

}  // namespace
