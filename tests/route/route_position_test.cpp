#include "panonav/route/route_position.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/motion/path.hpp"

namespace panonav {
namespace {

// A winding way that does not come by itself.
std::vector<Pose2> winding_path(Random& random) {
  std::vector<Pose2> path{{0.0, 0.0, 0.0}};
  for (int i = 0; i < 40; ++i) {
    path.push_back(path.back() * Pose2{0.1, 0.0, random.uniform(-0.05, 0.05)});
  }
  return path;
}

TEST(RoutePosition, IsWhereThePointOnTheRouteIs) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const auto path = winding_path(random);
    const double along_m = random.uniform(0.0, path_length_m(path));
    const Point2 there = point_on_route(path, along_m);
    const RoutePosition place = project_onto_route(path, there);
    EXPECT_NEAR(place.along_m, along_m, 1e-9);
    EXPECT_NEAR(place.lateral_m, 0.0, 1e-9);
    const auto all = find_passes(path, there, 0.3);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_NEAR(all[0].along_m, along_m, 1e-9);
  }
  const auto path = winding_path(random);
  EXPECT_EQ(point_on_route(path, -1.0), path.front().position());
  EXPECT_EQ(point_on_route(path, 100.0), path.back().position());
}

// Twice round a square: each side is passed twice, one length of the round apart.
TEST(RoutePosition, IsFoundEachTimeThatTheRouteComesBy) {
  const std::vector<Pose2> path{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0},
                                {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
  const auto places = find_passes(path, {2.5, 0.2}, 0.3);
  ASSERT_EQ(places.size(), 2U);
  EXPECT_NEAR(places[0].along_m, 2.5, 1e-12);
  EXPECT_NEAR(places[1].along_m, 18.5, 1e-12);
  EXPECT_NEAR(places[0].lateral_m, 0.2, 1e-12);
  EXPECT_TRUE(find_passes(path, {2.5, 0.2}, 0.1).empty());
  // A corner is one place each time, though two parts of the path are near.
  EXPECT_EQ(find_passes(path, {4.1, 4.1}, 0.3).size(), 2U);
}

TEST(RoutePosition, AStretchIsAsLongAsTheWaysBetweenItsEndsAndTheSameBack) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const auto path = winding_path(random);
    const double length_m = path_length_m(path);
    const double from_m = random.uniform(0.0, length_m);
    const double to_m = random.uniform(0.0, length_m);
    const auto stretch = route_segment(path, from_m, to_m);
    EXPECT_NEAR(path_length_m(stretch), std::abs(to_m - from_m), 1e-9);
    EXPECT_EQ(stretch.front(), point_on_route(path, from_m));
    EXPECT_EQ(stretch.back(), point_on_route(path, to_m));
    const auto back = route_segment(path, to_m, from_m);
    EXPECT_EQ(std::vector<Point2>(back.rbegin(), back.rend()), stretch);
  }
}

}  // namespace
}  // namespace panonav
