#include "panonav/motion/velocity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

void visit_options(BaseOptions& options, OptionVisitor& visitor) {
  using T = BaseOptions;
  constexpr OptionTable table{
      choice<&T::drive>("how the robot moves", "differential", "holonomic"),
      option<&T::speed_m_s>("highest speed", above(0), 100),
      option<&T::turn_rad_s>("highest speed of turning", above(0), 100),
      option<&T::period_s>("time for which a command holds", above(0), 10),
      option<&T::on_spot_rad>("a differential drive turns on the spot for larger angles", above(0),
                              std::numbers::pi / 2),
  };
  table.visit(options, visitor);
}

Velocity command_towards(double direction_rad, double distance_m, const BaseOptions& options) {
  validate(options);
  require(std::isfinite(direction_rad), "direction_rad", direction_rad, "finite");
  require(std::isfinite(distance_m) && distance_m >= 0.0, "distance_m", distance_m,
          ">= 0 and finite");
  if (distance_m == 0.0) return {};
  const double speed = std::min(options.speed_m_s, distance_m / options.period_s);
  if (options.drive == DriveKind::holonomic) {
    return {speed * std::cos(direction_rad), speed * std::sin(direction_rad), 0.0};
  }
  const double angle = wrap_angle(direction_rad);
  const double turn = std::clamp(angle / options.period_s, -options.turn_rad_s, options.turn_rad_s);
  if (std::abs(angle) > options.on_spot_rad) return {0.0, 0.0, turn};
  // No faster than the turn can follow: the arc to the point has the curvature 2 sin(angle) / d.
  const double arc =
      0.5 * options.turn_rad_s * distance_m / std::max(std::abs(std::sin(angle)), 1e-9);
  const double forward = std::min(speed * std::cos(angle), arc);
  return {forward, 0.0, turn};
}

namespace {

/// sin(t) / t and (1 - cos(t)) / t: how far along and across an arc leads.
struct Arc {
  explicit Arc(double turn_rad) {
    // Their series where the quotients lose their digits.
    const bool small = std::abs(turn_rad) < 1e-6;
    along = small ? 1.0 : std::sin(turn_rad) / turn_rad;
    across = small ? 0.5 * turn_rad : (1.0 - std::cos(turn_rad)) / turn_rad;
  }
  double along, across;
};

}  // namespace

Pose2 motion_after(const Velocity& velocity, double duration_s) {
  require(std::isfinite(duration_s) && duration_s >= 0.0, "duration_s", duration_s,
          ">= 0 and finite");
  const double turn = velocity.turn_rad_s * duration_s;
  const double x = velocity.forward_m_s * duration_s;
  const double y = velocity.left_m_s * duration_s;
  const Arc arc(turn);
  return {arc.along * x - arc.across * y, arc.across * x + arc.along * y, wrap_angle(turn)};
}

Velocity velocity_for(const Pose2& step, double duration_s) {
  require(std::isfinite(duration_s) && duration_s > 0.0, "duration_s", duration_s,
          "> 0 and finite");
  if (!is_finite(step)) throw ContractError("step", "not finite", "finite numbers");
  const double turn = wrap_angle(step.heading_rad);
  const Arc arc(turn);
  // The chord is as long as the arc times this, which is 2 / pi at least.
  const double square = arc.along * arc.along + arc.across * arc.across;
  return {(arc.along * step.x_m + arc.across * step.y_m) / square / duration_s,
          (arc.along * step.y_m - arc.across * step.x_m) / square / duration_s, turn / duration_s};
}

}  // namespace panonav
