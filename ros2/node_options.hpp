#pragma once

#include <string>

#include "panonav/core/options.hpp"

namespace panonav::ros2 {

/// Where the motion of the robot is read.
enum class MotionInput { odometry, tf };
/// How pictures come: "image" as sensor_msgs/Image, or "image/compressed" as CompressedImage.
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
};
void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor);

/// As REP 105 names them.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
};

/// Throws ContractError unless a message on `topic` is in the frame that the parameters name.
void require_frame(const std::string& topic, const std::string& frame, const std::string& expected);

}  // namespace panonav::ros2
