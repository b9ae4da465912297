#include "panonav/navigation/floor_scanner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "support/toy_world.hpp"

namespace panonav {
namespace {

constexpr ElevationBand floor_band{-1.0, FloorScanner::top_rad};

Panorama look(const testing::ToyWorld& world, const Pose2& pose, std::uint64_t seed) {
  Random noise(seed);
  return world.panorama(pose, FloorScanner::rows, FloorScanner::columns, floor_band, noise,
                        {.noise_deviation = 0.01});
}

/// Turns the robot's forward direction by a quarter to the right in its views and motion.
Panorama turn_quarter(const Panorama& view) {
  return rotate_columns(view, FloorScanner::columns / 4);
}
Pose2 turn_quarter(const Pose2& moved) {
  return {moved.y_m, -moved.x_m, moved.heading_rad};
}

/// Distance to the first wall or box, at steps of 1 cm.
double distance_to_wall_m(const testing::ToyWorld& world, const Pose2& robot, double azimuth_rad,
                          double max_m) {
  for (double m = 0.05; m < max_m; m += 0.01) {
    const Point2 there = robot * Point2{m * std::cos(azimuth_rad), m * std::sin(azimuth_rad)};
    if (world.clearance_m(there) < 0.011) return m;
  }
  return max_m;
}

/// A drive of 4 cm a picture through a room, which turns away from what is near.
template <class Visit>
void drive(const testing::Room& room, int pictures, const Visit& visit) {
  Random random(5);
  Pose2 pose = room.between(room.grid(0.5), 0.5, random);
  for (int i = 0; i < pictures; ++i) {
    const Pose2 before = pose;
    Pose2 next = pose * Pose2{0.04, 0.0, 0.01};
    while (!room.is_free(next.position())) {
      pose.heading_rad = wrap_angle(pose.heading_rad + random.uniform(-1.5, 1.5));
      next = pose * Pose2{0.04, 0.0, 0.0};
    }
    pose = next;
    visit(i, pose, inverse(before) * pose);
  }
}

TEST(FloorScanner, FindsNearObstaclesByParallaxAndRarelyOthers) {
  const testing::Room room(1, {.boxes = 5, .contrast = 0.5});
  FloorScanner scanner({});
  EXPECT_FALSE(scanner.scan().range_m.at(0));
  int near = 0;
  int found = 0;
  int free = 0;
  int alarms = 0;
  int unknown = 0;
  drive(room, 100, [&](int i, const Pose2& pose, const Pose2& moved) {
    scanner.add(look(room, pose, static_cast<std::uint64_t>(i)), moved);
    if (i < 20 || i % 8 != 0) return;
    const FloorScan scan = scanner.scan();
    ASSERT_EQ(scan.range_m.size(), std::size_t{FloorScanner::sectors});
    for (std::size_t s = 0; s < scan.range_m.size(); ++s) {
      if (!scan.range_m[s]) {
        ++unknown;
        continue;
      }
      const double azimuth_rad = scan.azimuth_rad(s);
      const double true_m = distance_to_wall_m(room, pose, azimuth_rad, scan.max_range_m);
      if (true_m < 0.6) {
        ++near;
        found += *scan.range_m[s] < true_m + 0.15 ? 1 : 0;
      }
      double nearest_m = true_m;  // in the sector and those beside it
      for (const double aside_rad : {-0.15, -0.1, -0.05, 0.05, 0.1, 0.15}) {
        nearest_m = std::min(
            nearest_m, distance_to_wall_m(room, pose, azimuth_rad + aside_rad, scan.max_range_m));
      }
      if (nearest_m < 0.9) continue;
      ++free;
      alarms += *scan.range_m[s] < 0.6 ? 1 : 0;
    }
  });
  ASSERT_GT(near, 50);
  ASSERT_GT(free, 100);
  EXPECT_GE(found, 0.8 * near);
  EXPECT_LE(alarms, 0.15 * free);
  EXPECT_LE(unknown, 0.1 * (near + free));
}

TEST(FloorScanner, SaysNothingOfPicturesWithoutTexture) {
  FloorScanner scanner({});
  const Panorama grey(FloorScanner::rows, FloorScanner::columns, floor_band);
  for (int i = 0; i < 5; ++i) scanner.add(grey, {0.04, 0.0, 0.0});
  for (const auto& range_m : scanner.scan().range_m) EXPECT_FALSE(range_m);
  // Over enough floor it learns what the floor looks like.
  for (int i = 0; i < 20; ++i) scanner.add(grey, {0.04, 0.0, 0.0});
  const FloorScan scan = scanner.scan();
  for (const auto& range_m : scan.range_m) EXPECT_EQ(range_m, scan.max_range_m);
}

TEST(FloorScanner, TurnsWithTheRobotsForwardDirection) {
  const testing::Room room(2, {.boxes = 5, .contrast = 0.5});
  FloorScanner scanner({});
  FloorScanner turned({});
  drive(room, 30, [&](int i, const Pose2& pose, const Pose2& moved) {
    const Panorama view = look(room, pose, static_cast<std::uint64_t>(i));
    scanner.add(view, moved);
    turned.add(turn_quarter(view), turn_quarter(moved));
  });
  const FloorScan scan = scanner.scan();
  const FloorScan other = turned.scan();
  int equal = 0;
  int obstacles = 0;
  for (std::size_t s = 0; s < scan.range_m.size(); ++s) {
    const auto range_m = scan.range_m[(s + scan.range_m.size() / 4) % scan.range_m.size()];
    equal += range_m == other.range_m[s] ? 1 : 0;
    obstacles += range_m && *range_m < scan.max_range_m ? 1 : 0;
  }
  EXPECT_GE(equal, FloorScanner::sectors - 2);  // rounding may decide between two distances
  EXPECT_GE(obstacles, 3);
}

TEST(FloorScanner, RefusesPanoramasOfAnotherShapeAndBand) {
  FloorScanner scanner({});
  EXPECT_THROW(scanner.add(Panorama(8, 32, floor_band), {}), ContractError);
  EXPECT_THROW(scanner.add(Panorama(FloorScanner::rows, FloorScanner::columns, std::nullopt), {}),
               ContractError);
  EXPECT_THROW(
      scanner.add(Panorama(FloorScanner::rows, FloorScanner::columns, ElevationBand{-1.0, 0.3}),
                  {}),
      ContractError);
  scanner.add(Panorama(FloorScanner::rows, FloorScanner::columns, floor_band), {});
  EXPECT_THROW(
      scanner.add(Panorama(FloorScanner::rows, FloorScanner::columns, ElevationBand{-0.9, -0.1}),
                  {}),
      ContractError);
  EXPECT_THROW(FloorScanner({.camera_height_m = 0.0}), ContractError);
  EXPECT_THROW(FloorScanner({.max_range_m = 0.1}), ContractError);
}

}  // namespace
}  // namespace panonav
