#include "panonav/localisation/internal/place_likelihood.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

/// An answer that the robot is at `where`, or with the rest of the probability at `other`.
Place answer_at(const Pose2& where, double probability, const std::optional<Pose2>& other = {}) {
  Place place;
  place.known = true;
  place.known_probability = other ? 0.98 : probability;
  place.probability = probability;
  const auto position = [](const Pose2& pose) {
    PositionEstimate estimate;
    estimate.x_m = pose.x_m;
    estimate.y_m = pose.y_m;
    estimate.radius_m = 0.5;
    return estimate;
  };
  place.position = position(where);
  place.heading_rad = where.heading_rad;
  if (other) {
    place.alternatives.push_back(
        {{}, place.known_probability - probability, position(*other), other->heading_rad});
  }
  return place;
}

TEST(PlaceLikelihood, AnswersLocaliseARobot) {
  const RememberedRoom place(74, {}, 0.3);
  auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  const ObservationModel model = learn_observation_model(*ranking, {.sampled_views = 8});
  MonteCarloLocaliser filter(std::move(ranking), model);
  const auto position_of = [&](ViewId view) {
    const ReferencePose& pose = *place.memory.info(view).pose;
    return Point2{pose.x_m, pose.y_m};
  };
  const auto views = place.memory.views();
  const Point2 first = position_of(views.front());
  const Point2 last = position_of(views.back());
  ASSERT_GT(distance(first, last), 2.0);
  const double towards_rad = std::atan2(last.y_m - first.y_m, last.x_m - first.x_m);
  const auto on_way = [&](int i) {
    return Pose2{first.x_m + 0.15 * i * std::cos(towards_rad),
                 first.y_m + 0.15 * i * std::sin(towards_rad), towards_rad};
  };
  // Two places fit equally well, of which only one moves as the robot does.
  MonteCarloEstimate estimate =
      filter.observe(answer_at(on_way(0), 0.49, Pose2{last.x_m, last.y_m, towards_rad + 2.0}));
  EXPECT_NE(estimate.state, LocalisationState::localised);
  ASSERT_GE(estimate.modes.size(), 2U);
  EXPECT_LT(estimate.modes[0].weight, 0.7);
  for (int i = 1; i < 8; ++i) {
    filter.move({0.15, 0.0, 0.0});
    estimate = filter.observe(answer_at(on_way(i), 0.9));
  }
  ASSERT_EQ(estimate.state, LocalisationState::localised);
  EXPECT_LT(distance(estimate.pose->position(), on_way(7).position()), 0.2);
  EXPECT_LT(std::abs(angle_difference(estimate.pose->heading_rad, towards_rad)), radians(6.0));
  EXPECT_FALSE(estimate.difference_here) << "no view was compared";
  // Carried to the other side, which nobody says.
  for (int i = 0; i < 8; ++i) {
    const Pose2 there{last.x_m - 0.15 * i * std::cos(towards_rad),
                      last.y_m - 0.15 * i * std::sin(towards_rad),
                      wrap_angle(towards_rad + std::numbers::pi)};
    if (i > 0) filter.move({0.15, 0.0, 0.0});
    estimate = filter.observe(answer_at(there, 0.9));
    if (i == 7) EXPECT_LT(distance(*estimate.position, there.position()), 0.2);
  }
  EXPECT_EQ(estimate.state, LocalisationState::localised);
  // Answers that the place is unknown.
  Place unknown;
  unknown.known_probability = unknown.probability = 0.01;
  for (int i = 0; i < 10; ++i) {
    filter.move({0.1, 0.0, 0.0});
    estimate = filter.observe(unknown);
  }
  EXPECT_EQ(estimate.state, LocalisationState::lost);
}

TEST(PlaceLikelihood, IsAProbabilityOfPoses) {
  const double spacing_m = 0.5;
  PlaceLikelihood likelihood(answer_at({5.0, 5.0, 0.3}, 0.6, Pose2{7.0, 4.0, 3.0}), 400, spacing_m,
                             true);
  ASSERT_TRUE(likelihood.is_informed());
  double sum = 0.0;
  constexpr int steps = 200;
  constexpr int headings = 120;
  for (int i = 0; i < steps * steps; ++i) {
    for (int h = 0; h < headings; ++h) {
      const Pose2 pose{10.0 * (i % steps + 0.5) / steps, 10.0 * (i / steps + 0.5) / steps,
                       2.0 * std::numbers::pi * h / headings};
      sum += std::exp(likelihood.log_ratio(pose));
    }
  }
  // The area of 400 views is 100 square metres, and the answer's probability is 1 at least.
  EXPECT_NEAR(sum / (static_cast<double>(steps) * steps * headings), 1.005, 0.01);
  Random random(1);
  int first = 0;
  for (int i = 0; i < 1000; ++i) first += likelihood.sample(random).x_m < 6.0 ? 1 : 0;
  EXPECT_NEAR(first, 1000 * 0.6 / 0.98, 60);
  PlaceLikelihood unknown(Place{}, 400, spacing_m, true);
  EXPECT_FALSE(unknown.is_informed());
  EXPECT_NEAR(unknown.log_ratio({1.0, 1.0, 0.0}), 0.0, 1e-12);
}

}  // namespace
}  // namespace panonav::testing
