#include "panonav/geometry/pose2.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

Pose2 random_pose(Random& random) {
  return {random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0),
          random.uniform(-std::numbers::pi, std::numbers::pi)};
}

void expect_same(const Pose2& a, const Pose2& b) {
  EXPECT_NEAR(a.x_m, b.x_m, 1e-11);
  EXPECT_NEAR(a.y_m, b.y_m, 1e-11);
  EXPECT_NEAR(angle_difference(a.heading_rad, b.heading_rad), 0.0, 1e-11);
}

TEST(Pose2, IsAGroup) {
  Random random(21);
  for (int i = 0; i < 500; ++i) {
    const Pose2 a = random_pose(random);
    const Pose2 b = random_pose(random);
    const Pose2 c = random_pose(random);
    expect_same((a * b) * c, a * (b * c));
    expect_same(a * inverse(a), {});
    expect_same(inverse(a) * a, {});
    expect_same(a * Pose2{}, a);
    expect_same(inverse(a * b), inverse(b) * inverse(a));
  }
}

TEST(Pose2, MovesPointsAsItComposes) {
  Random random(22);
  for (int i = 0; i < 500; ++i) {
    const Pose2 a_from_b = random_pose(random);
    const Pose2 b_from_c = random_pose(random);
    const Point2 p_in_c{random.uniform(-5, 5), random.uniform(-5, 5)};
    const Point2 one = (a_from_b * b_from_c) * p_in_c;
    const Point2 two = a_from_b * (b_from_c * p_in_c);
    EXPECT_NEAR(distance(one, two), 0.0, 1e-11);
    const Point2 q_in_c{random.uniform(-5, 5), random.uniform(-5, 5)};
    EXPECT_NEAR(distance(a_from_b * p_in_c, a_from_b * q_in_c), distance(p_in_c, q_in_c), 1e-11);
  }
}

TEST(Pose2, FollowsRep103) {
  // A robot at (1, 2) that faces north (y): one metre ahead is (1, 3), one metre to its left (0,
  // 2).
  const Pose2 world_from_robot{1.0, 2.0, std::numbers::pi / 2.0};
  const Point2 ahead = world_from_robot * Point2{1.0, 0.0};
  const Point2 left = world_from_robot * Point2{0.0, 1.0};
  EXPECT_NEAR(distance(ahead, {1.0, 3.0}), 0.0, 1e-12);
  EXPECT_NEAR(distance(left, {0.0, 2.0}), 0.0, 1e-12);
}

TEST(Direction3, AnglesRoundTrip) {
  Random random(23);
  for (int i = 0; i < 500; ++i) {
    const double azimuth = random.uniform(-3.1, 3.1);
    const double elevation = random.uniform(-1.5, 1.5);
    const Direction3 d = Direction3::from_angles(azimuth, elevation);
    EXPECT_NEAR(d.azimuth_rad(), azimuth, 1e-12);
    EXPECT_NEAR(d.elevation_rad(), elevation, 1e-12);
    EXPECT_NEAR(d.x * d.x + d.y * d.y + d.z * d.z, 1.0, 1e-12);
  }
  EXPECT_GT(Direction3::from_angles(0.5, 0.5).y, 0.0);  // counter-clockwise: y is left
}

}  // namespace
}  // namespace panonav
