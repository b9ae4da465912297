#include "panonav/motion/odometry.hpp"
#include "support/text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav::testing {
namespace {

Pose2 random_pose(Random& random) {
  return {random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
          random.uniform(-std::numbers::pi, std::numbers::pi)};
}

void expect_same(const Pose2& a, const Pose2& b, double tolerance = 1e-12) {
  EXPECT_NEAR(a.x_m, b.x_m, tolerance);
  EXPECT_NEAR(a.y_m, b.y_m, tolerance);
  EXPECT_NEAR(angle_difference(a.heading_rad, b.heading_rad), 0.0, tolerance);
}

OdometryNoise no_noise(DriveKind drive) {
  return {.drive = drive,
          .translation_from_translation = 0.0,
          .translation_from_rotation = 0.0,
          .rotation_from_translation = 0.0,
          .rotation_from_rotation = 0.0,
          .translation_scale_error = 0.0,
          .rotation_scale_error = 0.0};
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
};

template <class Draw>
Statistics statistics(int count, Draw draw) {
  double sum = 0.0;
  double sum2 = 0.0;
  for (int i = 0; i < count; ++i) {
    const double value = draw();
    sum += value;
    sum2 += value * value;
  }
  const double mean = sum / count;
  return {mean, std::sqrt((sum2 - count * mean * mean) / (count - 1))};
}

// A mean of n draws strays by more than 5 standard errors once in 1.7 million times, a standard
// deviation by more than 5 / sqrt(2 n) of itself about as seldom.
constexpr double sigmas = 5.0;

TEST(Odometry, WithoutNoiseAStepStaysAsItIs) {
  Random random(3);
  for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
    for (int i = 0; i < 100; ++i) {
      const Pose2 step = random_pose(random);
      expect_same(sample_step(step, no_noise(drive), random), step);
    }
  }
}

TEST(Odometry, ASamplerMovesAPoseByADrawnStep) {
  for (const DriveKind drive : {DriveKind::differential, DriveKind::holonomic}) {
    Random random(7);
    for (int i = 0; i < 100; ++i) {
      const Pose2 pose = random_pose(random);
      const Pose2 step = random_pose(random);
      const OdometryNoise noise{.drive = drive};
      const auto seed = static_cast<std::uint64_t>(i);
      Random first(seed);
      Random second(seed);
      expect_same(StepSampler(step, noise).move(pose, first),
                  pose * sample_step(step, noise, second));
    }
  }
}

TEST(Odometry, HolonomicNoiseHasTheStatedMomentsInAllDirections) {
  Random random(4);
  const OdometryNoise noise{.drive = DriveKind::holonomic};
  const Pose2 step{0.3, -0.4, 0.6};  // 0.5 m, 0.6 rad
  const int count = 20000;
  const double translation_sd = std::sqrt(0.03 * 0.03 * 0.5 + 0.005 * 0.005 * 0.6);
  const double rotation_sd = std::sqrt(0.02 * 0.02 * 0.5 + 0.03 * 0.03 * 0.6);
  const auto check = [&](double expected_mean, double expected_sd, auto component) {
    const Statistics s =
        statistics(count, [&] { return component(sample_step(step, noise, random)); });
    EXPECT_NEAR(s.mean, expected_mean, sigmas * expected_sd / std::sqrt(count));
    EXPECT_NEAR(s.deviation, expected_sd, sigmas * expected_sd / std::sqrt(2.0 * count));
  };
  check(step.x_m, translation_sd, [](const Pose2& p) { return p.x_m; });
  check(step.y_m, translation_sd, [](const Pose2& p) { return p.y_m; });
  check(step.heading_rad, rotation_sd, [](const Pose2& p) { return p.heading_rad; });
}

TEST(Odometry, DifferentialNoiseKeepsTheWheelsFromSlipping) {
  Random random(5);
  const OdometryNoise noise;
  const double turn = 0.4;
  const Pose2 arc{0.5 * std::cos(0.5 * turn), 0.5 * std::sin(0.5 * turn), turn};
  double largest_change = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const Pose2 sample = sample_step(arc, noise, random);
    // The chord of a circular arc points along the heading at its middle.
    EXPECT_NEAR(std::atan2(sample.y_m, sample.x_m), 0.5 * sample.heading_rad, 1e-9);
    largest_change = std::max(largest_change, std::abs(sample.heading_rad - turn));
  }
  EXPECT_GT(largest_change, 0.01);  // guard: there was noise
}

TEST(Odometry, DifferentialNoiseHasTheStatedMoments) {
  Random random(6);
  const OdometryNoise noise;
  const Pose2 step{0.5, 0.0, 0.0};
  const int count = 20000;
  const double translation_sd = 0.03 * std::sqrt(0.5);
  const double rotation_sd = 0.02 * std::sqrt(0.5);
  const Statistics travel = statistics(count, [&] {
    const Pose2 p = sample_step(step, noise, random);
    return std::hypot(p.x_m, p.y_m);
  });
  EXPECT_NEAR(travel.mean, 0.5, sigmas * translation_sd / std::sqrt(count));
  EXPECT_NEAR(travel.deviation, translation_sd, sigmas * translation_sd / std::sqrt(2.0 * count));
  const Statistics turn =
      statistics(count, [&] { return sample_step(step, noise, random).heading_rad; });
  EXPECT_NEAR(turn.mean, 0.0, sigmas * rotation_sd / std::sqrt(count));
  EXPECT_NEAR(turn.deviation, rotation_sd, sigmas * rotation_sd / std::sqrt(2.0 * count));
}

TEST(Odometry, NoiseDoesNotDependOnTheNumberOfSteps) {
  const int count = 4000;
  for (const int pieces : {1, 10}) {
    Random random(7, static_cast<std::uint64_t>(pieces));
    const OdometryNoise noise{.drive = DriveKind::holonomic};
    const Statistics heading = statistics(count, [&] {
      Pose2 pose;
      for (int i = 0; i < pieces; ++i) {
        pose = pose * sample_step({1.0 / pieces, 0.0, 0.0}, noise, random);
      }
      return pose.heading_rad;
    });
    EXPECT_NEAR(heading.deviation, 0.02, sigmas * 0.02 / std::sqrt(2.0 * count)) << pieces;
  }
}

TEST(Odometry, OptionsOutOfRangeAreNamed) {
  OdometryNoise noise;
  noise.rotation_from_rotation = -0.1;
  noise.translation_scale_error = std::nan("");
  const auto text = message_of<OptionError>([&] { validate(noise); });
  EXPECT_TRUE(contains(text, "rotation_from_rotation is -0.1"));
  EXPECT_TRUE(contains(text, "translation_scale_error is nan"));
}

}  // namespace
}  // namespace panonav::testing
