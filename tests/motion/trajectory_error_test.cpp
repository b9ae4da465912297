#include "panonav/motion/trajectory_error.hpp"

#include <gtest/gtest.h>

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
  EXPECT_LT(error->heading_rad.largest, 1e-9);
  EXPECT_GT(error->relative_pairs, 50U);
  EXPECT_LT(error->relative_position_m.largest, 1e-9);
  const auto unaligned = trajectory_error(estimate, truth, {.align = false});
  ASSERT_TRUE(unaligned);
  EXPECT_GT(unaligned->position_m.median, 1.0);
  EXPECT_NEAR(unaligned->heading_rad.mean, 2.5, 1e-9);
  EXPECT_LT(unaligned->relative_position_m.largest, 1e-9);
}

TEST(TrajectoryError, ScaleAndReflectionOnlyWhenAllowed) {
  const Trajectory truth = curve(100);
  const Trajectory larger = moved(truth, {1, 1, 0.4}, 2.0);
  EXPECT_GT(trajectory_error(larger, truth)->position_m.rms, 0.5);
  EXPECT_LT(trajectory_error(larger, truth, {.align_scale = true})->position_m.rms, 1e-9);
  Trajectory mirrored;
  for (const StampedPose& s : truth.poses()) {
    mirrored.append({s.stamp_s, {s.pose.x_m, -s.pose.y_m, -s.pose.heading_rad}});
  }
  EXPECT_GT(trajectory_error(mirrored, truth)->position_m.rms, 0.05);
  const auto allowed = trajectory_error(mirrored, truth, {.align_reflection = true});
  EXPECT_LT(allowed->position_m.rms, 1e-9);
  EXPECT_LT(allowed->heading_rad.largest, 1e-9);
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
  EXPECT_NEAR(error->heading_rad.rms, 0.02, 0.001);
  // Two positions err, seen in a frame whose heading errs: sqrt(2) more, and 0.02 rad at 1 m.
  EXPECT_NEAR(error->relative_position_m.rms, std::hypot(0.2, 0.02), 0.01);
  EXPECT_LE(error->position_m.median, error->position_m.p95);
  EXPECT_LE(error->position_m.p95, error->position_m.largest);
}

TEST(TrajectoryError, AssociatesByStamp) {
  // The truth of a straight run, sampled at other times and with a hole.
  const Trajectory truth({{0.0, {0, 0, 0}}, {1.0, {1, 0, 0}}, {5.0, {5, 0, 0}}, {6.0, {6, 0, 0}}});
  const Trajectory estimate({{0.25, {0.25, 0, 0}},
                             {0.75, {0.75, 0, 0}},
                             {3.0, {9, 9, 1}},
                             {5.5, {5.5, 0, 0}},
                             {7.0, {7, 0, 0}}});
  const auto error = trajectory_error(estimate, truth, {.align = false});
  ASSERT_TRUE(error);
  EXPECT_EQ(error->pairs, 3U);
  EXPECT_EQ(error->left_out, 2U);
  EXPECT_LT(error->position_m.largest, 1e-12);
}

TEST(TrajectoryError, TooLittleInCommonIsNoAnswer) {
  const Trajectory truth = curve(10);
  EXPECT_FALSE(trajectory_error(Trajectory{}, truth));
  EXPECT_FALSE(trajectory_error(truth, Trajectory{}));
  EXPECT_FALSE(trajectory_error(Trajectory({{100.0, {}}, {101.0, {}}}), truth));
  EXPECT_THROW((void)trajectory_error(truth, truth, {.max_gap_s = -1}), OptionError);
  const auto error = trajectory_error(truth, truth, {.relative_distance_m = 1000});
  ASSERT_TRUE(error);
  EXPECT_EQ(error->relative_pairs, 0U);
}

}  // namespace
}  // namespace panonav
