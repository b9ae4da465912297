#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav::simulation {

/// The odometry of one run: a pose in the odometry frame, which is the robot's frame at the start.
/// The scale errors are drawn once, at construction.
class SimulatedOdometry {
 public:
  /// Throws OptionError.
  SimulatedOdometry(const OdometryNoise& noise, std::uint64_t seed) : noise_(noise), random_(seed) {
    validate(noise_);
    translation_scale_ = random_.normal(1.0, noise_.translation_scale_error);
    rotation_scale_ = random_.normal(1.0, noise_.rotation_scale_error);
  }

  /// Adds the measurement of a true step `step`. Returns odometry_from_robot after it.
  Pose2 advance(const Pose2& step) {
    Pose2 measured = sample_step(step, noise_, random_);
    // The chord of the step turns by half the additional turn, as in sample_step, so that the
    // wheels still do not slip.
    const double extra_turn = (rotation_scale_ - 1.0) * measured.heading_rad;
    const double half = noise_.drive == DriveKind::differential ? 0.5 * extra_turn : 0.0;
    const double c = translation_scale_ * std::cos(half);
    const double s = translation_scale_ * std::sin(half);
    measured = {c * measured.x_m - s * measured.y_m, s * measured.x_m + c * measured.y_m,
                wrap_angle(measured.heading_rad + extra_turn)};
    odometry_from_robot_ = odometry_from_robot_ * measured;
    return odometry_from_robot_;
  }
  /// Returns odometry_from_robot, the pose by odometry.
  [[nodiscard]] const Pose2& pose() const noexcept { return odometry_from_robot_; }

 private:
  OdometryNoise noise_;
  Random random_;
  double translation_scale_ = 1.0;
  double rotation_scale_ = 1.0;
  Pose2 odometry_from_robot_;
};

/// Simulates odometry along true poses: one reading per pose, the first one the identity. Throws
/// OptionError.
[[nodiscard]] inline std::vector<Pose2> simulate_odometry(std::span<const Pose2> world_from_robot,
                                                          const OdometryNoise& noise,
                                                          std::uint64_t seed) {
  SimulatedOdometry odometry(noise, seed);
  std::vector<Pose2> readings;
  readings.reserve(world_from_robot.size());
  for (std::size_t i = 0; i < world_from_robot.size(); ++i) {
    readings.push_back(
        i == 0 ? odometry.pose()
               : odometry.advance(inverse(world_from_robot[i - 1]) * world_from_robot[i]));
  }
  return readings;
}

}  // namespace panonav::simulation
