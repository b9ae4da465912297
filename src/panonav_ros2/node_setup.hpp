#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "panonav/core/options.hpp"
#include "panonav/pipeline/robot_explorer.hpp"
#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav_ros2/participant.hpp"
#include "panonav_ros2/teacher.hpp"

namespace panonav::ros2 {

/// Source of the robot's motion.
enum class MotionInput { odometry, tf };
/// Message type of the images: sensor_msgs/Image on "image", or CompressedImage on
/// "image/compressed".
enum class PictureInput { raw, compressed };

struct LocalisationNodeOptions {
  MotionInput motion = MotionInput::odometry;
  PictureInput pictures = PictureInput::raw;
  double transform_tolerance_s = 1.0;
  double transform_rate_hz = 50.0;
  bool use_sim_time = false;
  bool tilt_from_imu = false;
  double command_timeout_s = 0.5;
  double resume_s = 30.0;
  double camera_x_m = 0.0;
  double camera_y_m = 0.0;
  double camera_height_m = 0.0;  ///< above the floor; 0: no `~/floor_scan`
  double robot_radius_m = 0.2;

  /// Returns the pose of the camera, which is upright and faces forward.
  [[nodiscard]] Pose2 base_from_camera() const { return {camera_x_m, camera_y_m, 0.0}; }
};
void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor);

/// Names of the frames, defaults as in REP 105.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
};

/// An exploration by the robot itself. Drive and limits of velocities are those of goals.
struct ExplorationSetup {
  PictureSource pictures;
  ExplorationOptions exploration;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

struct LocalisationNodeSetup {
  std::filesystem::path memory;
  ParticipantOptions participant;
  FrameNames frames;
  LocalisationNodeOptions node;
  TrackerOptions tracker;
  RobotNavigatorOptions navigator;  ///< for goals; its base options also for routes
  /// Set if the first drive makes a new memory, until the command "finish".
  std::optional<TeacherOptions> teacher;
  /// Set if an exploration makes a new memory, after the command "explore".
  std::optional<ExplorationSetup> exploration;
};

using NowNs = std::function<std::int64_t()>;  ///< current time, simulated or of the system

/// Throws ContractError unless `frame`, that of a message on `topic`, is `expected`, the name in
/// the parameters.
void require_frame(const std::string& topic, const std::string& frame, const std::string& expected);

}  // namespace panonav::ros2
