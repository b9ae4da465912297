// One horizon scanline to a pose: the direct fit and its rival, the dual contours as published, on
// a route of 5 m with a line every 2 cm or 10 cm. One core.

#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "lab/y03/route_contours.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/route/route_fit.hpp"
#include "panonav/route/route_panorama.hpp"

namespace {

using namespace panonav;

constexpr int columns = 360;

/// The walls of a room of 9 x 5 m with a texture of random waves.
std::vector<float> line_at(const Pose2& pose) {
  static const std::vector<std::pair<double, double>> waves = [] {
    Random random(3);
    std::vector<std::pair<double, double>> made;
    for (int i = 0; i < 24; ++i) made.emplace_back(random.uniform(0.5, 9.0), random.uniform(0, 6));
    return made;
  }();
  std::vector<float> line;
  for (int c = 0; c < columns; ++c) {
    const double azimuth = pose.heading_rad + 2.0 * std::numbers::pi * c / columns;
    const double ux = std::cos(azimuth);
    const double uy = std::sin(azimuth);
    const double to_x = std::abs(((ux > 0.0 ? 7.0 : -2.0) - pose.x_m) / ux);
    const double to_y = std::abs(((uy > 0.0 ? 2.5 : -2.5) - pose.y_m) / uy);
    const bool side = to_x < to_y;
    const double at = side ? pose.y_m + to_x * uy + 20.0 : pose.x_m + to_y * ux + (uy > 0 ? 40 : 0);
    double value = 0.5;
    for (const auto& [frequency, phase] : waves) value += 0.05 * std::sin(frequency * at + phase);
    line.push_back(static_cast<float>(value));
  }
  return line;
}

RoutePanorama route_with(double spacing_m) {
  RoutePanorama route(columns);
  for (int i = 0; i * spacing_m <= 5.0; ++i) {
    const Pose2 pose{i * spacing_m, 0.0, 0.0};
    route.append(pose, std::span<const float>(line_at(pose)));
  }
  return route;
}

struct Question {
  std::vector<float> line;
  Pose2 predicted;
};
std::vector<Question> questions() {
  std::vector<Question> all;
  Random random(4);
  for (int i = 0; i < 32; ++i) {
    const Pose2 pose{random.uniform(1.5, 3.5), random.uniform(-0.5, 0.5), random.uniform(-3, 3)};
    all.push_back({line_at(pose), pose * Pose2{0.03, -0.04, 0.035}});
  }
  return all;
}

template <typename Model>
void fit(benchmark::State& state, const Model& model) {
  const auto asked = questions();
  std::size_t i = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    const Question& question = asked[i++ % asked.size()];
    const auto fix = model.fit(question.line, question.predicted);
    found += fix ? 1 : 0;
    benchmark::DoNotOptimize(fix);
  }
  if (found < i) state.SkipWithError("a line without an answer");
}

void direct_fit(benchmark::State& state) {
  fit(state, RouteLines(route_with(0.01 * static_cast<double>(state.range(0)))));
}
void dual_contours(benchmark::State& state) {
  fit(state, RouteContours(route_with(0.01 * static_cast<double>(state.range(0)))));
}
BENCHMARK(direct_fit)->ArgName("spacing_cm")->Arg(2)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(dual_contours)->ArgName("spacing_cm")->Arg(2)->Arg(10)->Unit(benchmark::kMicrosecond);

}  // namespace
