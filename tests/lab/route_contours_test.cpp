#include "lab/y03/route_contours.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/toy_world.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

RoutePanorama straight_route(const ToyWorld& room) {
  RoutePanorama route;
  for (int i = 0; i <= 150; ++i) {
    const Pose2 pose{0.02 * i - 1.5, 0.0, 0.0};
    route.append(pose, room.line(pose));
  }
  return route;
}

TEST(RouteContours, ConvergeFromBothSidesOntoThePoseThatOdometryNearlyKnows) {
  double error = 0.0;
  double predicted_error = 0.0;
  int met = 0;
  constexpr int trials = 24;
  std::vector<ToyWorld> rooms;
  std::vector<RouteContours> routes;
  for (std::uint64_t seed = 60; seed < 63; ++seed) {
    rooms.push_back(pillared_room(seed, 30.0));
    routes.emplace_back(straight_route(rooms.back()));
  }
  for (int trial = 0; trial < trials; ++trial) {
    const ToyWorld& room = rooms[static_cast<std::size_t>(trial % 3)];
    const RouteContours& contours = routes[static_cast<std::size_t>(trial % 3)];
    Random random(100 + static_cast<std::uint64_t>(trial));
    const Pose2 truth{random.uniform(-0.7, 0.7), random.uniform(-0.4, 0.4),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    const Pose2 predicted{truth.x_m + 0.04, truth.y_m - 0.03, wrap_angle(truth.heading_rad + 0.01)};
    const auto fix = contours.fit(room.line(truth), predicted);
    ASSERT_TRUE(fix.has_value());
    ASSERT_EQ(fix->columns.size(), fix->first.size());
    ASSERT_EQ(fix->columns.size(), fix->second.size());
    error += distance(fix->pose.position(), truth.position()) / trials;
    predicted_error += distance(predicted.position(), truth.position()) / trials;
    met += fix->converged ? 1 : 0;
    EXPECT_GT(fix->iterations, 0);
    EXPECT_GT(fix->covariance[0], 0.0);
  }
  EXPECT_LT(error, 0.6 * predicted_error);
  EXPECT_GE(met, trials / 2);
}

TEST(RouteContours, NoAnswerWithoutEdgesOrOutOfReach) {
  const ToyWorld room = pillared_room(3);
  const RouteContours contours(straight_route(room));
  EXPECT_FALSE(contours.fit(std::vector<float>(360, 0.4F), {0, 0.1, 0}).has_value());
  EXPECT_THROW((void)contours.fit(std::vector<float>(12, 0.4F), {0, 0.1, 0}), ContractError);
  EXPECT_THROW((void)RouteContours(straight_route(room), -1.0), ContractError);
  RoutePanorama one;
  one.append({0, 0, 0}, room.line({0, 0, 0}));
  EXPECT_THROW((void)RouteContours(one), ContractError);
}

}  // namespace
}  // namespace panonav::lab
