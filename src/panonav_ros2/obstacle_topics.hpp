#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "panonav/navigation/explorer.hpp"
#include "panonav_ros2/node_setup.hpp"
#include "panonav_ros2/participant.hpp"
#include "panonav_ros2/robot_motion.hpp"

namespace panonav::ros2 {

/// Subscribes to the robot's sensors for obstacles: `scan` and `contact`, in the base frame or in a
/// frame that `/tf_static` connects to it. Receives on the participant's thread.
class ObstacleTopics {
 public:
  ObstacleTopics(Participant& participant, const FrameNames& frames, WarningLog& log,
                 RobotMotion& motion);

  /// Returns the contact since the last call of this or `take`, in the base frame. May be called
  /// from any thread.
  [[nodiscard]] std::optional<Point2> take_contact();

  /// True if a scan was received. May be called from any thread.
  [[nodiscard]] bool has_scan() const;

  /// Obstacles in the frame of the camera.
  struct Sensed {
    std::optional<double> contact_rad;             ///< direction of a contact
    std::vector<ExplorationReport::Range> ranges;  ///< at most `sectors`, each in another one
  };
  static constexpr int sectors = 32;  ///< in which the shortest range is used: 11 degrees each
  /// Returns the newest scan, if it is as old as the image, and the contact since the last call.
  /// `path_from_camera` is the camera's pose at the image. May be called from one other thread.
  [[nodiscard]] Sensed take(std::int64_t stamp_ns, const Pose2& path_from_camera,
                            const Pose2& base_from_camera);

 private:
  struct Scan {
    std::int64_t stamp_ns = 0;
    std::vector<Point2> ends;  // in the base frame
    std::vector<bool> has_echo;
  };
  void receive(const recordings::ros::LaserScan& scan);
  void receive(const recordings::ros::PointStamped& contact);
  [[nodiscard]] recordings::ros::Pose base_from(const std::string& topic,
                                                const std::string& frame) const;

  FrameNames frames_;
  RobotMotion& motion_;
  FrameTree tree_;
  mutable std::mutex mutex_;  // guards the following members
  std::optional<Scan> scan_;
  std::optional<Point2> contact_;  // in the base frame
};

}  // namespace panonav::ros2
