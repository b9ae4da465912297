#include "panonav/motion/velocity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/command.hpp"

namespace panonav {

void visit_options(BaseOptions& options, OptionVisitor& visitor) {
  using T = BaseOptions;
  constexpr OptionTable table{
      choice<&T::drive>("type of drive of the robot", "differential", "holonomic"),
      option<&T::speed_m_s>("largest speed", 0.001, 100),
      option<&T::turn_rad_s>("largest rotation speed", 0.001, 100),
      option<&T::period_s>("time for which a command is valid", 0.001, 10),
      option<&T::on_spot_rad>("largest change of heading that a robot with differential drive "
                              "makes while driving; for larger changes it rotates on the spot",
                              above(0), std::numbers::pi / 2),
  };
  table.visit(options, visitor);
}

Velocity compute_command_towards(double direction_rad, double distance_m,
                                 const BaseOptions& options) {
  validate(options);
  require(std::isfinite(direction_rad), "direction_rad", direction_rad, "finite");
  require(std::isfinite(distance_m) && distance_m >= 0.0, "distance_m", distance_m,
          ">= 0 and finite");
  return command_towards(direction_rad, distance_m, options);
}

Pose2 integrate_velocity(const Velocity& velocity, double duration_s) {
  require(std::isfinite(duration_s) && duration_s >= 0.0, "duration_s", duration_s,
          ">= 0 and finite");
  const double turn = velocity.turn_rad_s * duration_s;
  const double x = velocity.forward_m_s * duration_s;
  const double y = velocity.left_m_s * duration_s;
  // sin(t) / t and (1 - cos(t)) / t; for small t by their series, because the quotients lose
  // precision.
  const bool small = std::abs(turn) < 1e-6;
  const double along = small ? 1.0 : std::sin(turn) / turn;
  const double across = small ? 0.5 * turn : (1.0 - std::cos(turn)) / turn;
  return {along * x - across * y, across * x + along * y, wrap_angle(turn)};
}

}  // namespace panonav
