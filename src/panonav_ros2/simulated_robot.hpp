#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav_ros2/participant.hpp"

namespace panonav::ros2 {

struct SimulatedRobotOptions {
  double picture_rate_hz = 10.0;
  double odometry_rate_hz = 50.0;
  double time_factor = 1.0;
  double velocity_timeout_s = 0.5;
};
void visit_options(SimulatedRobotOptions& options, OptionVisitor& visitor);

/// Start pose, obstacles and images of a simulated robot. `picture` is called on a separate thread,
/// one image at a time.
struct SimulatedSurroundings {
  Pose2 start;
  std::function<bool(Point2 place)> is_free;
  std::function<Image(const Pose2& pose, std::uint64_t seed)> picture;
  /// Measures ranges in equally spaced directions, the first one forward, counter-clockwise;
  /// `max_range_m` where nothing is. Empty: the robot publishes no scan.
  std::function<std::vector<double>(const Pose2& pose, std::uint64_t seed)> ranges;
  double max_range_m = 3.0;
  double robot_radius_m = 0.2;
};

/// A simulated robot with the ROS 2 interface of a real one, in simulated time. It publishes
/// /clock, odom, odom -> base_link on /tf, images on image, with each image ranges on scan, points
/// of contact on contact and, for evaluation, ground_truth; it subscribes to cmd_vel and to
/// set_pose (PoseStamped), which moves the robot without its odometry noticing. Obstacles stop it.
class SimulatedRobot {
 public:
  /// Throws OptionError, and as `Participant`.
  SimulatedRobot(const ParticipantOptions& participant, const SimulatedRobotOptions& options,
                 SimulatedSurroundings surroundings, const OdometryNoise& odometry,
                 std::uint64_t seed, Note note);
  ~SimulatedRobot();
  SimulatedRobot(const SimulatedRobot&) = delete;
  SimulatedRobot& operator=(const SimulatedRobot&) = delete;

  /// Runs until `stop` is called.
  void run();
  /// Makes `run` return. May be called from any thread.
  void stop();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::ros2
