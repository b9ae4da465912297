#include "panonav/route/route_changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_fit.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

RoutePanorama straight_route(const ToyWorld& room, double spacing_m) {
  RoutePanorama route;
  for (int i = 0; i * spacing_m <= 4.0; ++i) {
    const Pose2 pose{-2.0 + i * spacing_m, 0.0, 0.0};
    route.append(pose, std::span<const float>(room.line(pose)));
  }
  return route;
}

// Pictures of a drive beside the route in which something is named, and how many ranges hold
// `thing`.
struct Named {
  int pictures = 0;
  int right = 0;
  int ranges = 0;
};
Named drive(const RouteLines& lines, const ToyWorld& room, Point2 thing,
            RouteChanges changes = {}) {
  Named named;
  for (int i = 0; i <= 40; ++i) {
    const Pose2 pose = Pose2{-1.2, -0.2, 0.15} * Pose2{0.05 * i, 0.0, 0.0};
    const auto fix = lines.fit(room.line(pose), pose * Pose2{0.02, 0.02, 0.01});
    EXPECT_TRUE(fix.has_value());
    if (!fix) return named;
    const auto ranges = changes.add(*fix);
    named.pictures += ranges.empty() ? 0 : 1;
    const double azimuth =
        std::atan2(thing.y_m - pose.y_m, thing.x_m - pose.x_m) - pose.heading_rad;
    for (const RouteChanges::AzimuthRange& range : ranges) {
      const double middle = range.from_rad + 0.5 * wrap_angle(range.to_rad - range.from_rad);
      ++named.ranges;
      named.right += std::abs(angle_difference(middle, azimuth)) < radians(40.0) ? 1 : 0;
    }
  }
  return named;
}

TEST(RouteChanges, UnchangedRoomsShowNothingAndAMovedPillarIsNamedWhereItStands) {
  int rooms_with_change = 0;
  for (const std::uint64_t seed : {31, 32, 33, 34, 35, 36, 37, 38}) {
    const ToyWorld room = pillared_room(seed);
    const RouteLines lines(straight_route(room, 0.1));
    EXPECT_EQ(drive(lines, room, {}).pictures, 0) << seed;
    ToyWorld changed = room;
    const Point2 before = room.pillar(0);
    changed.move_pillar({0.5, 0.0});
    const Named named =
        drive(lines, changed, {before.x_m + 0.25, before.y_m}, RouteChanges(lines.poses()));
    rooms_with_change += named.pictures > 0 ? 1 : 0;
    EXPECT_GE(10 * named.right, 9 * named.ranges) << seed;
  }
  EXPECT_GE(rooms_with_change, 7);
}

// Pictures between two lines are interpolated: pictures from one gap share its error.
TEST(RouteChanges, PicturesNearestToTheSameLineCountOnce) {
  std::vector<Pose2> line_poses;
  for (int i = 0; i < 12; ++i) line_poses.push_back({0.1 * i, 0.0, 0.0});
  RouteFix fix;
  fix.noise = 0.01;
  fix.unexplained.assign(360, 0.0F);
  for (std::size_t c = 90; c < 110; ++c) fix.unexplained[c] = 0.031F;
  RouteChanges by_pictures;
  RouteChanges by_lines{line_poses};
  int first_by_pictures = 0;
  int first_by_lines = 0;
  for (int picture = 1; picture <= 60; ++picture) {
    fix.pose.x_m = 0.02 * picture;
    if (!by_pictures.add(fix).empty() && first_by_pictures == 0) first_by_pictures = picture;
    if (!by_lines.add(fix).empty() && first_by_lines == 0) first_by_lines = picture;
  }
  EXPECT_EQ(first_by_pictures, 5);
  EXPECT_GE(first_by_lines, 16) << "0.32 m, where the fifth line begins to be nearest";
  EXPECT_LE(first_by_lines, 24);
  // The same line again and again is no new witness.
  RouteChanges standing{line_poses};
  for (int picture = 0; picture < 20; ++picture) EXPECT_TRUE(standing.add(fix).empty());
}

TEST(RouteChanges, TakesFivePicturesAndStartsAnewAfterAMiss) {
  RouteFix fix;
  fix.noise = 0.01;
  fix.unexplained.assign(360, 0.0F);
  for (std::size_t c = 90; c < 110; ++c) fix.unexplained[c] = 0.031F;
  RouteChanges changes;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(changes.add(fix).empty());
  const auto ranges = changes.add(fix);
  ASSERT_EQ(ranges.size(), 1U);
  EXPECT_NEAR(ranges[0].from_rad, radians(90.0), 1e-9);
  EXPECT_NEAR(ranges[0].to_rad, radians(110.0), 1e-9);
  changes.reset();
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(changes.add(fix).empty());
  // Within the noise, or too narrow: nothing.
  RouteChanges none;
  for (std::size_t c = 90; c < 110; ++c) fix.unexplained[c] = 0.029F;
  fix.unexplained[200] = 0.5F;
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(none.add(fix).empty());
}

}  // namespace
}  // namespace panonav::testing
