#include "panonav/relative_pose/orientation_evidence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_views.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

/// Returns the view that is read if the columns are taken to run in the other direction, or forward
/// to be at another azimuth than it is.
HomingView misread(const HomingView& view, const OrientationFault& fault) {
  const HomingView turned = rotate(view, fault.turn_rad);
  if (!fault.is_mirrored) return turned;
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < turned.components(); ++k) {
    for (const float value : turned.cosines(k)) cosines.push_back(value);
    for (const float value : turned.sines(k)) sines.push_back(-value);
  }
  return {turned.rows(), turned.components(), cosines, sines, turned.elevations()};
}

/// Poses of a robot that walks about in a room.
std::vector<Pose2> walk(const Room& room, std::uint64_t seed, double turn_deviation_rad) {
  Random random(seed, 7);
  std::vector<Pose2> poses{room.between(room.grid(0.5), 0.0, random)};
  while (poses.size() < 60) {
    const Pose2 next = poses.back() * Pose2{0.1, 0.0, random.normal(0.0, turn_deviation_rad)};
    const double away_rad = random.uniform(0.5, 1.0) * std::numbers::pi;
    poses.push_back(room.is_free((next * Pose2{0.2, 0.0, 0.0}).position())
                        ? next
                        : poses.back() * Pose2{0.0, 0.0, away_rad});
  }
  return poses;
}

OrientationEvidence compare_along(const std::vector<Pose2>& poses, const Room& room,
                                  const OrientationFault& fault) {
  std::vector<HomingView> views;
  for (const Pose2& pose : poses) {
    views.push_back(misread(homing_view(compute_signature(room.see(pose), 16)), fault));
  }
  OrientationEvidence evidence;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    evidence.add(views[i], views[i + 1], inverse(poses[i]) * poses[i + 1]);
  }
  return evidence;
}

TEST(OrientationEvidence, FindsMirroredColumnsAndWrongForwardDirections) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Room room(seed, {});
    for (const OrientationFault& fault :
         {OrientationFault{true, 0.0}, OrientationFault{false, 1.0}, OrientationFault{false, -2.5},
          OrientationFault{true, 2.0}}) {
      SCOPED_TRACE(fault.turn_rad);
      const auto found = compare_along(walk(room, seed, 0.2), room, fault).find_fault();
      ASSERT_TRUE(found.has_value());
      EXPECT_EQ(found->is_mirrored, fault.is_mirrored);
      EXPECT_LT(std::abs(angle_difference(found->turn_rad, fault.turn_rad)), radians(8.0));
    }
  }
}

TEST(OrientationEvidence, FindsNothingWhereAllIsAsStated) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Room room(seed, {});
    const auto evidence = compare_along(walk(room, seed, 0.2), room, {});
    EXPECT_GT(evidence.turns(), 10U);
    EXPECT_FALSE(evidence.find_fault().has_value()) << seed;
  }
}

TEST(OrientationEvidence, AStraightDriveDoesNotShowTheDirectionOfColumns) {
  const Room room(1, {.width_m = 12.0, .depth_m = 12.0, .boxes = 0, .contrast = 0.15});
  std::vector<Pose2> straight;
  for (int i = 0; i < 60; ++i) straight.push_back({3.0 + 0.1 * i, 6.0, 0.0});
  const auto evidence = compare_along(straight, room, {true, 0.0});
  EXPECT_EQ(evidence.turns(), 0U);
  EXPECT_FALSE(evidence.find_fault().has_value());
}

TEST(OrientationEvidence, NoiseShowsNothing) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    OrientationEvidence evidence;
    const auto poses = walk(Room(seed, {}), seed, 0.2);
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
      const auto draw = [&] {
        return homing_view(
            compute_signature(random_panorama(random, 8, 64, ElevationBand{-0.6, 0.6}), 16));
      };
      const HomingView home = draw();
      evidence.add(home, draw(), inverse(poses[i]) * poses[i + 1]);
    }
    EXPECT_FALSE(evidence.find_fault().has_value()) << seed;
  }
}

}  // namespace
}  // namespace panonav::testing
