#include "panonav_ros2/node_setup.hpp"

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::ros2 {

void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor) {
  using T = LocalisationNodeOptions;
  constexpr OptionTable table{
      choice<&T::motion>("where motion is read: the topic odom, or TF", "odometry", "tf"),
      choice<&T::pictures>("the topic image, or image/compressed", "raw", "compressed"),
      option<&T::transform_tolerance_s>("how far the transform is dated ahead", 0, 60),
      option<&T::transform_rate_hz>("how often the transform is sent", above(0), 1000),
      option<&T::use_sim_time>("time is what the topic /clock says"),
      option<&T::tilt_from_imu>("level pictures by the orientation on the topic imu"),
      option<&T::command_timeout_s>("a driven robot stops after this time without a picture",
                                    above(0), 60),
      option<&T::resume_s>("a node that died and is started again within this time continues the "
                           "goal it had; 0: never",
                           0, 86400),
      option<&T::camera_x_m>("camera in front of the base frame's origin", -10, 10),
      option<&T::camera_y_m>("and to its left", -10, 10),
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
