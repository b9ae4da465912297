#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>

#include "panonav/pipeline/observation.hpp"
#include "panonav_ros2/node_setup.hpp"
#include "panonav_ros2/participant.hpp"
#include "panonav_ros2/robot_motion.hpp"
#include "panonav_ros2/work_queue.hpp"

namespace panonav::ros2 {

/// Subscribes to the robot's sensors (odometry or TF, tilt, images, simulated time), checks the
/// messages and passes them on. Runs on the participant's thread.
class SensorTopics {
 public:
  SensorTopics(Participant& participant, const LocalisationNodeOptions& options,
               const FrameNames& frames, WarningLog& log, RobotMotion& motion, WorkQueue& queue);

  /// Returns the current time, simulated or of the system. May be called from any thread.
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] std::string picture_topic() const;
  [[nodiscard]] std::string motion_source() const;  ///< "topic odom", for messages to users
  /// Warns if several programs publish the same input.
  void check_publishers() const;
  /// Decodes an image message; the observation is named by its topic. Returns it with its time
  /// stamp in ns and the frame of the camera. Throws as `ros::to_image`.
  [[nodiscard]] std::tuple<Observation, std::int64_t, std::string> decode(
      std::span<const std::uint8_t> message) const;

 private:
  void receive(const recordings::ros::Odometry& odometry);
  void receive(const recordings::ros::TFMessage& message);
  void receive(const recordings::ros::Imu& imu);
  void receive_picture(std::int64_t stamp_ns, std::span<const std::uint8_t> cdr);
  void add_motion(const std::string& topic, std::int64_t stamp_ns,
                  const recordings::ros::Pose& pose);

  Participant& participant_;
  LocalisationNodeOptions options_;
  FrameNames frames_;
  WarningLog& log_;
  RobotMotion& motion_;
  WorkQueue& queue_;
  FrameTree tree_;
  bool has_transform_ = false;
  std::optional<std::int64_t> last_picture_ns_;
  std::atomic<std::int64_t> simulated_time_ns_ = 0;
};

}  // namespace panonav::ros2
