// One home vector: Fourier homing of one row and of a whole panorama, and its rival, expected
// images, with the published sizes. One core.

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "lab/baselines/expected_image_homing.hpp"
#include "panonav/core/random.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace {

using namespace panonav;

/// Smooth surroundings with some noise, seen from two places.
std::vector<float> row_of(int columns, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> row;
  for (int c = 0; c < columns; ++c) {
    const double azimuth = 2.0 * std::numbers::pi * c / columns;
    double value = 0.5;
    for (int k = 1; k <= 12; ++k) {
      value += 0.2 / k * std::cos(k * azimuth + 1.3 * k * k + 0.02 * static_cast<double>(seed));
    }
    row.push_back(static_cast<float>(value + random.normal(0.0, 0.01)));
  }
  return row;
}

HomingView view_of(int rows, int components, std::uint64_t seed) {
  constexpr int columns = 360;
  Panorama panorama(rows, columns,
                    rows > 1 ? std::optional(ElevationBand{-0.5, 0.7}) : std::nullopt);
  for (int y = 0; y < rows; ++y) {
    const auto row = row_of(columns, seed + static_cast<std::uint64_t>(y));
    for (int c = 0; c < columns; ++c) panorama.at(y, c) = row[static_cast<std::size_t>(c)];
  }
  return homing_view(compute_signature(panorama, components));
}

void run(benchmark::State& state, int rows, int components, const FourierHomingOptions& options) {
  std::vector<HomingView> currents;
  for (std::uint64_t i = 0; i < 16; ++i) currents.push_back(view_of(rows, components, 100 + i));
  const HomingView home = view_of(rows, components, 99);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(home_vector_unchecked(home, currents[i++ % 16], options));
  }
}

void published_k5(benchmark::State& state) {
  run(state, 1, 7, published_homing_options(5));
}
void published_k5_two_iterations(benchmark::State& state) {
  run(state, 1, 8, published_homing_options(5, 2));
}
void own_k5(benchmark::State& state) {
  run(state, 1, 7, {.highest = 5});
}
void own_k10(benchmark::State& state) {
  run(state, 1, 12, {.highest = 10});
}
void own_80_rows(benchmark::State& state) {
  run(state, 80, 15, {});
}
BENCHMARK(published_k5);
BENCHMARK(published_k5_two_iterations);
BENCHMARK(own_k5);
BENCHMARK(own_k10);
BENCHMARK(own_80_rows)->Unit(benchmark::kMicrosecond);

void expected_images(benchmark::State& state) {
  const int columns = static_cast<int>(state.range(0));
  const lab::ExpectedImageHoming homing(columns);
  const auto home = row_of(columns, 99);
  const auto current = row_of(columns, 107);
  for (auto _ : state) benchmark::DoNotOptimize(homing.home_vector(home, current));
}
BENCHMARK(expected_images)->Arg(72)->Arg(360)->Unit(benchmark::kMicrosecond);

}  // namespace
