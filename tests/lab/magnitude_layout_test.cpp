#include "lab/m04/magnitude_layout.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"

namespace panonav::lab {
namespace {

/// Positions on a grid of 7 x 5, each up to a tenth of the spacing beside its grid point.
std::vector<Point2> make_grid(Random& random) {
  std::vector<Point2> points;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 5; ++j)
      points.push_back({i + random.uniform(-0.1, 0.1), j + random.uniform(-0.1, 0.1)});
  }
  return points;
}

/// Views whose magnitudes are waves over the plane, in random directions and of random lengths from
/// 6 to 20 spacings; each value is raised to `power`.
std::vector<FourierSignature> make_views(const std::vector<Point2>& points, Random& random,
                                         double power = 1.0) {
  const SignatureShape shape{.rows = 20, .components = 6};
  std::vector<std::vector<float>> magnitudes(points.size());
  for (std::size_t feature = 0; feature < shape.size(); ++feature) {
    const double direction_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double wave_number = 2.0 * std::numbers::pi / random.uniform(6.0, 20.0);
    const double phase_rad = random.uniform(0.0, 2.0 * std::numbers::pi);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double along =
          points[i].x_m * std::cos(direction_rad) + points[i].y_m * std::sin(direction_rad);
      const double value = 2.0 + std::sin(wave_number * along + phase_rad);
      magnitudes[i].push_back(static_cast<float>(std::pow(value, power)));
    }
  }
  std::vector<FourierSignature> views;
  for (auto& values : magnitudes)
    views.emplace_back(shape, std::move(values), std::vector<float>(shape.size()), std::nullopt);
  return views;
}

double measure_shape(const std::vector<Point2>& found, const std::vector<Point2>& truth) {
  return shape_difference(found, truth).with_reflection;
}

std::vector<double> distances_between(const std::vector<Point2>& points) {
  std::vector<double> distances;
  for (const Point2 a : points) {
    for (const Point2 b : points) distances.push_back(distance(a, b));
  }
  return distances;
}

TEST(AllPairs, ExactDistancesGiveTheTrueShape) {
  Random random(1);
  const auto points = make_grid(random);
  const auto found =
      arrange_by_all_pairs(points.size(), distances_between(points), DissimilarityCurve(3.0));
  EXPECT_LT(measure_shape(found, points), 1e-9);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(distance(found[0], found[i]), 3.0 * distance(points[0], points[i]), 1e-6);
  }
}

TEST(AllPairs, CurveUndoesAMonotoneDistortion) {
  Random random(2);
  const auto points = make_grid(random);
  const auto distances = distances_between(points);
  std::vector<double> saturating;
  std::vector<DissimilarityCurve::Sample> pairs;
  for (const double d : distances) {
    saturating.push_back(1.0 - std::exp(-0.3 * d));
    pairs.push_back({saturating.back(), d});
  }
  const DissimilarityCurve curve(pairs, 1.0);
  EXPECT_LT(measure_shape(arrange_by_all_pairs(points.size(), saturating, curve), points), 0.002);
  const DissimilarityCurve straight(1.0);
  EXPECT_GT(measure_shape(arrange_by_all_pairs(points.size(), saturating, straight), points),
            0.005);
}

TEST(MagnitudeLayout, SmoothMagnitudesGiveTheTrueShapeDespiteAMonotoneDistortion) {
  for (const auto& [power, max_difference] :
       {std::pair{0.5, 0.003}, std::pair{1.0, 0.003}, std::pair{2.0, 0.02}}) {
    Random random(3);
    const auto points = make_grid(random);
    const auto views = make_views(points, random, power);
    Executor executor(1);
    EXPECT_LT(measure_shape(arrange_by_magnitudes(views, executor), points), max_difference)
        << power;
  }
}

TEST(MagnitudeLayout, IsNotChangedByTurnsOrThreads) {
  Random random(4);
  const auto points = make_grid(random);
  auto views = make_views(points, random);
  Executor one(1);
  const auto found = arrange_by_magnitudes(views, one);
  for (auto& view : views) view = turn(view, random.uniform(-3.0, 3.0));
  Executor two(2);
  EXPECT_EQ(arrange_by_magnitudes(views, two), found);
}

TEST(MagnitudeLayout, KeepsTwoClustersApartAndTheirShapes) {
  Random random(5);
  auto points = make_grid(random);
  const std::size_t half = points.size();
  const auto second = make_grid(random);
  for (const Point2 p : second) points.push_back({p.x_m + 11.0, p.y_m});
  Executor executor(1);
  const auto found = arrange_by_magnitudes(make_views(points, random), executor);
  const auto middle = static_cast<std::ptrdiff_t>(half);
  EXPECT_LT(measure_shape({found.begin(), found.begin() + middle},
                          {points.begin(), points.begin() + middle}),
            0.02);
  EXPECT_LT(
      measure_shape({found.begin() + middle, found.end()}, {points.begin() + middle, points.end()}),
      0.02);
  // The gap is wider than any distance between neighbours.
  double gap = INFINITY;
  double widest = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    double nearest = INFINITY;
    for (std::size_t j = 0; j < found.size(); ++j) {
      if (i == j) continue;
      double& smallest = (i < half) == (j < half) ? nearest : gap;
      smallest = std::min(smallest, distance(found[i], found[j]));
    }
    widest = std::max(widest, nearest);
  }
  EXPECT_GT(gap, 2.0 * widest);
}

TEST(MagnitudeLayout, RefusesTooFewAndEqualViews) {
  Random random(6);
  const auto points = make_grid(random);
  const auto views = make_views(points, random);
  Executor executor(1);
  EXPECT_THROW(static_cast<void>(arrange_by_magnitudes(std::span(views).first(2), executor)),
               ContractError);
  const std::vector<FourierSignature> equal(5, views.front());
  EXPECT_THROW(static_cast<void>(arrange_by_magnitudes(equal, executor)), ContractError);
  const std::vector<double> distances(9, 1.0);
  EXPECT_THROW(static_cast<void>(arrange_by_all_pairs(4, distances, DissimilarityCurve(1.0))),
               ContractError);
  EXPECT_THROW(static_cast<void>(arrange_by_all_pairs(2, distances, DissimilarityCurve(1.0))),
               ContractError);
}

}  // namespace
}  // namespace panonav::lab
