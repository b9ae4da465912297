#include "panonav/motion/odometry.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

void visit_options(OdometryNoise& options, OptionVisitor& visitor) {
  using T = OdometryNoise;
  constexpr OptionTable table{
      choice<&T::drive>("type of drive of the robot", "differential", "holonomic"),
      option<&T::translation_from_translation>(
          "standard deviation of the measured distance after 1 m, in m", 0, 10),
      option<&T::translation_from_rotation>(
          "standard deviation of the measured distance after a rotation by 1 rad, in m", 0, 10),
      option<&T::rotation_from_translation>(
          "standard deviation of the measured heading after 1 m, in rad", 0, 10),
      option<&T::rotation_from_rotation>(
          "standard deviation of the measured heading after a rotation by 1 rad, in rad", 0, 10),
      option<&T::translation_scale_error>("standard deviation of the relative error of distances; "
                                          "the error is constant during a run",
                                          0, 10),
      option<&T::rotation_scale_error>("standard deviation of the relative error of rotations; the "
                                       "error is constant during a run",
                                       0, 10),
  };
  table.visit(options, visitor);
}

StepSampler::StepSampler(const Pose2& step, const OdometryNoise& noise)
    : step_(step),
      is_holonomic_(noise.drive == DriveKind::holonomic),
      cos_middle_(std::cos(0.5 * step.heading_rad)),
      sin_middle_(std::sin(0.5 * step.heading_rad)) {
  const double travel = std::hypot(step.x_m, step.y_m);
  const double turn = std::abs(step.heading_rad);
  const auto deviation = [travel, turn](double per_metre, double per_radian) {
    return std::sqrt(per_metre * per_metre * travel + per_radian * per_radian * turn);
  };
  translation_deviation_m_ =
      deviation(noise.translation_from_translation, noise.translation_from_rotation);
  // Upper bound against overflow; a heading is completely unknown at far smaller values.
  constexpr double max_deviation_rad = 1000.0;
  rotation_deviation_rad_ = std::min(
      max_deviation_rad, deviation(noise.rotation_from_translation, noise.rotation_from_rotation));
  step_.heading_rad = wrap_angle(step.heading_rad);
}

Pose2 StepSampler::move(const Pose2& world_from_robot, Random& random) const {
  const auto [first, second] = random.normal_pair();
  const Pose2 error =
      error_from_deviates(first, second, is_holonomic_ ? random.normal_pair().first : 0.0);
  const double x = step_.x_m + error.x_m;
  const double y = step_.y_m + error.y_m;
  const double direction =
      world_from_robot.heading_rad + turn_share_before_travel() * error.heading_rad;
  const double c = std::cos(direction);
  const double s = std::sin(direction);
  return {world_from_robot.x_m + c * x - s * y, world_from_robot.y_m + s * x + c * y,
          wrap_angle(world_from_robot.heading_rad + step_.heading_rad + error.heading_rad)};
}

Pose2 sample_step(const Pose2& step, const OdometryNoise& noise, Random& random) {
  return StepSampler(step, noise).move({}, random);
}

}  // namespace panonav
