#include "panonav/motion/trajectory_error.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

/// A curve that goes nowhere twice, with the heading along it.
Trajectory curve(int poses) {
  Trajectory result;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.1 * i;
    result.append({t, {t, std::sin(t), std::atan(std::cos(t))}});
  }
  return result;
}

Trajectory moved(const Trajectory& trajectory, const Pose2& b_from_a, double scale = 1.0) {
  Trajectory result;
  for (const StampedPose& stamped : trajectory.poses()) {
    const Pose2 pose{stamped.pose.x_m * scale, stamped.pose.y_m * scale, stamped.pose.heading_rad};
    result.append({stamped.stamp_s, b_from_a * pose});
  }
  return result;
}

TEST(Trajectory, InterpolatesAlongTheShorterTurn) {
  const Pose2 a{0.0, 0.0, 3.0};
  const Pose2 b{2.0, 4.0, -3.0};
  const Pose2 middle = interpolate(a, b, 0.5);
  EXPECT_NEAR(middle.x_m, 1.0, 1e-12);
  EXPECT_NEAR(middle.y_m, 2.0, 1e-12);
  EXPECT_NEAR(std::abs(angle_difference(middle.heading_rad, std::numbers::pi)), 0.0, 1e-12);
  EXPECT_NEAR(interpolate(a, b, 0.0).heading_rad, 3.0, 1e-12);
  EXPECT_NEAR(interpolate(a, b, 1.0).heading_rad, -3.0, 1e-12);
}

TEST(Trajectory, AnswersInsideAndNothingOutside) {
  const Trajectory trajectory(
      {{1.0, {0.0, 0.0, 0.0}}, {2.0, {1.0, 0.0, 0.2}}, {5.0, {1.0, 3.0, 0.2}}});
  ASSERT_TRUE(trajectory.at(1.5).has_value());
  EXPECT_NEAR(trajectory.at(1.5)->x_m, 0.5, 1e-12);
  EXPECT_NEAR(trajectory.at(1.5)->heading_rad, 0.1, 1e-12);
  EXPECT_EQ(*trajectory.at(1.0), trajectory.poses()[0].pose);
  EXPECT_EQ(*trajectory.at(5.0), trajectory.poses()[2].pose);
  EXPECT_NEAR(trajectory.at(3.0)->y_m, 1.0, 1e-12);
  EXPECT_FALSE(trajectory.at(0.999).has_value());
  EXPECT_FALSE(trajectory.at(5.001).has_value());
  EXPECT_FALSE(trajectory.at(std::nan("")).has_value());
  EXPECT_FALSE(trajectory.at(3.0, 2.0).has_value());
  EXPECT_TRUE(trajectory.at(1.5, 2.0).has_value());
  EXPECT_FALSE(Trajectory().at(0.0).has_value());
}

TEST(Trajectory, RefusesStampsThatDoNotAscendAndNumbersThatAreNotFinite) {
  EXPECT_THROW(Trajectory(std::vector<StampedPose>{{1.0, {}}, {1.0, {}}}), ContractError);
  EXPECT_THROW(Trajectory(std::vector<StampedPose>{{std::nan(""), {}}}), ContractError);
  Trajectory trajectory(std::vector<StampedPose>{{1.0, {}}});
  EXPECT_THROW(trajectory.append({0.5, {}}), ContractError);
  EXPECT_THROW(trajectory.append({2.0, {std::numeric_limits<double>::infinity(), 0.0, 0.0}}),
               ContractError);
  EXPECT_EQ(trajectory.size(), 1U);
  trajectory.append({2.0, {}});
  EXPECT_EQ(trajectory.size(), 2U);
  try {
    Trajectory({{1.0, {}}, {2.0, {}}, {1.5, {}}});
    FAIL() << "no error";
  } catch (const ContractError& error) {
    EXPECT_STREQ(error.what(),
                 "pose 2 of a trajectory: stamp_s is 1.5; allowed: > 2, the stamp before");
  }
}

TEST(TrajectoryError, AnotherFrameIsNoError) {
  const Trajectory truth = curve(100);
  const Trajectory estimate = moved(truth, {3, -2, 2.5});
  const auto error = trajectory_error(estimate, truth);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->pairs, 100U);
  EXPECT_EQ(error->left_out, 0U);
  EXPECT_LT(error->position_m.largest, 1e-9);
  EXPECT_LT(error->rotation_rad.largest, 1e-7);
  EXPECT_TRUE(error->planar);
  EXPECT_GT(error->relative_pairs, 9U);
  EXPECT_LT(error->relative_position_m.largest, 1e-9);
  const auto unaligned = trajectory_error(estimate, truth, {.align = TrajectoryError::Align::none});
  ASSERT_TRUE(unaligned);
  EXPECT_GT(unaligned->position_m.median, 1.0);
  EXPECT_NEAR(unaligned->rotation_rad.mean, 2.5, 1e-9);
  EXPECT_LT(unaligned->relative_position_m.largest, 1e-9);
}

TEST(TrajectoryError, ScaleAndReflectionOnlyWhenAllowed) {
  const Trajectory truth = curve(100);
  const Trajectory larger = moved(truth, {1, 1, 0.4}, 2.0);
  EXPECT_GT(trajectory_error(larger, truth)->position_m.rms, 0.5);
  EXPECT_LT(trajectory_error(larger, truth, {.align = TrajectoryError::Align::similarity})
                ->position_m.rms,
            1e-9);
  Trajectory mirrored;
  for (const StampedPose& s : truth.poses()) {
    mirrored.append({s.stamp_s, {s.pose.x_m, -s.pose.y_m, -s.pose.heading_rad}});
  }
  EXPECT_GT(trajectory_error(mirrored, truth)->position_m.rms, 0.05);
  const auto allowed = trajectory_error(mirrored, truth, {.align_reflection = true});
  EXPECT_LT(allowed->position_m.rms, 1e-9);
  EXPECT_LT(allowed->rotation_rad.largest, 1e-7);
}

TEST(TrajectoryError, NoiseOfKnownSizeIsMeasured) {
  Random random(5);
  const Trajectory truth = curve(4000);
  Trajectory estimate;
  for (const StampedPose& s : truth.poses()) {
    estimate.append({s.stamp_s,
                     {s.pose.x_m + random.normal(0, 0.1), s.pose.y_m + random.normal(0, 0.1),
                      s.pose.heading_rad + random.normal(0, 0.02)}});
  }
  const auto error = trajectory_error(estimate, truth);
  ASSERT_TRUE(error);
  // Standard error of a root mean square over 4000 pairs: about 1 %.
  EXPECT_NEAR(error->position_m.rms, 0.1 * std::sqrt(2.0), 0.006);
  EXPECT_NEAR(error->rotation_rad.rms, 0.02, 0.001);
  // Two positions err, seen in a frame whose heading errs: sqrt(2) more, and 0.02 rad at 1 m.
  EXPECT_NEAR(error->relative_position_m.rms, std::hypot(0.2, 0.02), 0.02);
  EXPECT_LE(error->position_m.median, error->position_m.p95);
  EXPECT_LE(error->position_m.p95, error->position_m.largest);
}

std::vector<StampedPose3> at_stamps(const std::vector<double>& stamps_s) {
  std::vector<StampedPose3> poses;
  for (const double stamp_s : stamps_s) poses.push_back({stamp_s, {{stamp_s, 0, 0}, {}}});
  return poses;
}

TEST(TrajectoryError, TheShorterTrajectoryChoosesTheNearestStamps) {
  const auto few = at_stamps({0.25, 1.004, 1.006, 3.5, 9.0});
  const auto many = at_stamps({0.0, 1.0, 1.012, 2.0, 3.25, 3.75, 5.0});
  const auto found = pair_by_stamp(few, many, 0.01);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0], (PosePair{1, 1}));
  EXPECT_EQ(found[1].estimate, 2U);
  const auto swapped = pair_by_stamp(many, few, 0.25);
  ASSERT_EQ(swapped.size(), 4U);
  EXPECT_EQ(swapped[0], (PosePair{0, 0}));
  EXPECT_EQ(swapped[3], (PosePair{4, 3}));  // 3.25 and 3.75 are equally near
  // Brute force over random stamps.
  Random random(21);
  for (int round = 0; round < 20; ++round) {
    std::vector<double> a(20);
    std::vector<double> b(31);
    for (double& stamp : a) stamp = random.uniform(0, 10);
    for (double& stamp : b) stamp = random.uniform(0, 10);
    std::ranges::sort(a);
    std::ranges::sort(b);
    std::vector<PosePair> pairs;
    for (std::size_t i = 0; i < a.size(); ++i) {
      std::size_t nearest = 0;
      for (std::size_t k = 1; k < b.size(); ++k) {
        if (std::abs(b[k] - a[i]) < std::abs(b[nearest] - a[i])) nearest = k;
      }
      if (std::abs(b[nearest] - a[i]) <= 0.1) pairs.push_back({i, nearest});
    }
    EXPECT_EQ(pair_by_stamp(at_stamps(a), at_stamps(b), 0.1), pairs);
  }
}

TEST(TrajectoryError, CameraAxesAreAnotherFrame) {
  // The same path in axes of a camera: x right, y down, z forward.
  std::vector<StampedPose3> truth;
  std::vector<StampedPose3> camera;
  const Rotation3 robot_from_camera = Rotation3::from_matrix({0, 0, 1, -1, 0, 0, 0, -1, 0});
  const Trajectory path = curve(50);
  for (const StampedPose& stamped : path.poses()) {
    truth.push_back({stamped.stamp_s, to_pose3(stamped.pose)});
    const Pose3 in_camera = inverse(Pose3{{1, 2, 3}, robot_from_camera}) * truth.back().pose;
    camera.push_back(
        {stamped.stamp_s, {in_camera.position, in_camera.rotation * robot_from_camera}});
  }
  const auto error = trajectory_error(camera, truth);
  ASSERT_TRUE(error);
  EXPECT_FALSE(error->planar);
  EXPECT_LT(error->position_m.largest, 1e-9);
  EXPECT_NEAR(error->rotation_rad.rms, robot_from_camera.angle_rad(), 1e-9);  // its axes stay
  const auto unaligned = trajectory_error(camera, truth, {.align = TrajectoryError::Align::none});
  EXPECT_GT(unaligned->position_m.rms, 1.0);
}

TEST(TrajectoryError, RelativeErrorsAreThoseOfConsecutiveParts) {
  // Steps of 0.4 m: parts begin at poses 3, 6, 9, ...; the estimate is 10 % too long.
  std::vector<StampedPose3> truth;
  std::vector<StampedPose3> estimate;
  for (int i = 0; i < 14; ++i) {
    truth.push_back({0.1 * i, {{0.4 * i, 0, 0.1}, {}}});
    estimate.push_back({0.1 * i, {{0.44 * i, 0, 0.2}, Rotation3::from_yaw(0.01 * i)}});
  }
  const auto error = trajectory_error(estimate, truth, {.align = TrajectoryError::Align::none});
  ASSERT_TRUE(error);
  ASSERT_EQ(error->relative_pairs, 3U);
  EXPECT_NEAR(error->relative_rotation_rad.largest, 0.03, 1e-9);
  const Point3 first = inverse(estimate[3].pose.rotation) * Point3{1.32, 0, 0};
  EXPECT_NEAR(error->relative_position_m.median,
              distance(inverse(estimate[6].pose.rotation) * Point3{1.32, 0, 0}, {1.2, 0, 0}), 1e-9);
  EXPECT_LE(distance(first, {1.2, 0, 0}), error->relative_position_m.largest);
}

TEST(TrajectoryError, TooLittleInCommonIsNoAnswer) {
  const Trajectory truth = curve(10);
  EXPECT_FALSE(trajectory_error(Trajectory{}, truth));
  EXPECT_FALSE(trajectory_error(truth, Trajectory{}));
  EXPECT_FALSE(trajectory_error(Trajectory({{100.0, {}}, {101.0, {}}}), truth));
  EXPECT_THROW((void)trajectory_error(truth, truth, {.max_stamp_difference_s = -1}), OptionError);
  const auto error = trajectory_error(truth, truth, {.relative_distance_m = 1000});
  ASSERT_TRUE(error);
  EXPECT_EQ(error->relative_pairs, 0U);
}

}  // namespace
}  // namespace panonav
