#pragma once

#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// An odometry step is `robot_old_from_robot_new`: the pose of the robot after the step in the
/// frame of the robot before it. It does not depend on any world frame.

/// Kind of drive, which determines the shape of odometry errors.
enum class DriveKind {
  differential,  ///< cannot move sideways: travel errors lie along the heading at the middle of the
                 ///< step
  holonomic,     ///< moves in every direction: travel errors are equal in x and y
};

/// Error model of odometry. The random part is a random walk: its variance grows with distance and
/// rotation, so the uncertainty of a path does not depend on the number of steps. The systematic
/// part is a scale error (wheel radius, wheel base) that is constant during a run. The defaults are
/// typical of small wheeled robots on flat floors without slip; measure your robot's values.
struct OdometryNoise {
  /// Drive of the robot: wheels, or a platform that can move sideways.
  DriveKind drive = DriveKind::differential;
  /// Standard deviation of travel after 1 m (m); of each of x and y for a holonomic robot.
  double translation_from_translation = 0.03;
  /// Standard deviation of travel after turning by 1 rad (m).
  double translation_from_rotation = 0.005;
  /// Standard deviation of the heading after 1 m (rad).
  double rotation_from_translation = 0.02;
  /// Standard deviation of the heading after turning by 1 rad (rad).
  double rotation_from_rotation = 0.03;
  /// Standard deviation, from run to run, of the constant relative error of travel.
  double translation_scale_error = 0.02;
  /// Standard deviation, from run to run, of the constant relative error of turns.
  double rotation_scale_error = 0.01;
};
void visit_options(OdometryNoise& options, OptionVisitor& visitor);

/// Samples noisy versions of an odometry step: true motions for a reported step, or reported steps
/// for a true motion. Only the random, zero-mean errors of travel and rotation are added.
/// Differential drive: the direction of travel stays fixed relative to the heading at the middle of
/// the step, as for wheels without slip.
class StepSampler {
 public:
  /// `noise` must be valid.
  StepSampler(const Pose2& step, const OdometryNoise& noise);

  /// Returns the pose after the step of a robot that was at `world_from_robot` before. Draws one
  /// `Random::normal_pair` for a differential drive, two for a holonomic one. Cost: 0.1
  /// microseconds.
  [[nodiscard]] Pose2 move(const Pose2& world_from_robot, Random& random) const;

  /// The step with its heading in [-pi, pi).
  [[nodiscard]] const Pose2& step() const noexcept { return step_; }
  /// True for a holonomic drive, whose travel errors are equal in x and y.
  [[nodiscard]] bool is_holonomic() const noexcept { return is_holonomic_; }
  /// Standard deviation of its travel (m); of each of x and y for a holonomic drive.
  [[nodiscard]] double translation_deviation_m() const noexcept { return translation_deviation_m_; }
  /// Standard deviation of its turn (rad).
  [[nodiscard]] double rotation_deviation_rad() const noexcept { return rotation_deviation_rad_; }
  /// Converts standard normal deviates (`third` is used only for a holonomic drive) to errors of
  /// travel and rotation in the frame of the robot before the step. The caller must first rotate
  /// this frame by `turn_share_before_travel` times the error of the rotation.
  [[nodiscard]] Pose2 error_from_deviates(double first, double second,
                                          double third) const noexcept {
    if (is_holonomic_) {
      return {first * translation_deviation_m_, second * translation_deviation_m_,
              third * rotation_deviation_rad_};
    }
    const double travel_m = first * translation_deviation_m_;
    return {travel_m * cos_middle_, travel_m * sin_middle_, second * rotation_deviation_rad_};
  }
  /// Share of the rotation's error that acts before the travel: 0 for a holonomic drive, 1/2 for
  /// wheels, which travel in the direction at the middle of the rotation.
  [[nodiscard]] double turn_share_before_travel() const noexcept {
    return is_holonomic_ ? 0.0 : 0.5;
  }

 private:
  Pose2 step_;
  bool is_holonomic_;
  double translation_deviation_m_;
  double rotation_deviation_rad_;
  double cos_middle_, sin_middle_;  ///< of half the turn
};

/// Draws one step.
[[nodiscard]] Pose2 sample_step(const Pose2& step, const OdometryNoise& noise, Random& random);

}  // namespace panonav
