#include "panonav_ros2/node_setup.hpp"

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::ros2 {

void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor) {
  using T = LocalisationNodeOptions;
  constexpr OptionTable table{
      choice<&T::motion>("source of the robot's motion: the topic odom, or TF", "odometry", "tf"),
      choice<&T::pictures>("topic of the images: image for raw, image/compressed for compressed",
                           "raw", "compressed"),
      option<&T::transform_tolerance_s>("time by which the stamp of the transform is in the future",
                                        0, 60),
      option<&T::transform_rate_hz>("rate at which the transform is sent", above(0), 1000),
      option<&T::use_sim_time>("use the time of the topic /clock"),
      option<&T::tilt_from_imu>(
          "correct the tilt of images with the orientation from the topic imu"),
      option<&T::command_timeout_s>("time without an image after which a driving robot stops",
                                    above(0), 60),
      option<&T::resume_s>("longest interruption after which a restarted node continues to its "
                           "last goal; 0: never continue",
                           0, 86400),
      option<&T::camera_x_m>(
          "position of the camera: distance in front of the origin of the base frame", -10, 10),
      option<&T::camera_y_m>(
          "position of the camera: distance to the left of the origin of the base frame", -10, 10),
      option<&T::camera_height_m>(
          "height of the camera above the floor; publishes the free floor as ~/floor_scan; 0: not "
          "published",
          0, 10),
      option<&T::robot_radius_m>(
          "radius of the robot around the origin of the base frame, for an exploration and for "
          "~/floor_scan",
          above(0), 10),
  };
  table.visit(options, visitor);
}

void require_frame(const std::string& topic, const std::string& frame,
                   const std::string& expected) {
  if (frame == expected) return;
  throw ContractError("frame of the message",
                      "'" + to_readable_line(shorten_middle(frame, 60)) + "'",
                      expected + ", as the parameters name it for " + topic);
}

}  // namespace panonav::ros2
