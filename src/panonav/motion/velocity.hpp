#pragma once

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav {

/// Velocity of a robot in its own frame: x forward, y left, rotation counter-clockwise.
struct Velocity {
  double forward_m_s = 0.0;  ///< along the heading, below 0 backwards
  double left_m_s = 0.0;     ///< 0 for a differential drive
  double turn_rad_s = 0.0;   ///< counter-clockwise seen from above
  friend bool operator==(const Velocity&, const Velocity&) = default;
};

/// Interface to the drive of a robot, real or simulated. A command is valid until the next one; a
/// base should stop by itself if commands stop coming.
class RobotBase {
 public:
  virtual ~RobotBase() = default;
  /// Drives at this velocity until the next command.
  virtual void command(const Velocity& velocity) = 0;
};

/// Limits of a base, and the period of its commands.
struct BaseOptions {
  DriveKind drive = DriveKind::differential;  ///< wheels, or a platform that can move sideways
  double speed_m_s = 0.3;                     ///< highest, > 0
  double turn_rad_s = 1.0;                    ///< highest, > 0
  double period_s = 0.1;                      ///< time for which a command holds, > 0
  double on_spot_rad = 0.7854;  ///< a differential drive turns on the spot for larger angles
};
void visit_options(BaseOptions& options, OptionVisitor& visitor);

/// Computes the command for the next period towards a point at `direction_rad` and `distance_m` in
/// the current robot frame. The command never drives past the point. A holonomic robot keeps its
/// heading; a differential drive rotates towards the point, on the spot if the angle exceeds
/// `on_spot_rad`, and reduces its speed with the cosine of the angle. At distance 0 the velocity is
/// 0. Throws ContractError on numbers that are not finite or a distance below 0, OptionError.
[[nodiscard]] Velocity compute_command_towards(double direction_rad, double distance_m,
                                               const BaseOptions& options);

/// Returns the motion `robot_old_from_robot_new` of driving at this velocity for `duration_s` >= 0:
/// an arc, or a straight line.
[[nodiscard]] Pose2 integrate_velocity(const Velocity& velocity, double duration_s);

}  // namespace panonav
