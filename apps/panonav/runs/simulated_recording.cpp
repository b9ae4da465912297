#include "runs/simulated_recording.hpp"

#include "cli/option_values.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

namespace {

/// Parses "X,Y,HEADING_DEG". Throws UsageError.
Pose2 parse_pose(const std::string& flag, const std::string& text) {
  const std::size_t first = text.find(',');
  const std::size_t second = first == std::string::npos ? first : text.find(',', first + 1);
  if (second == std::string::npos) {
    throw UsageError(flag + " is '" + text +
                     "'; allowed: X,Y,HEADING_DEG in metres, metres and degrees");
  }
  return {parse_number(flag, text.substr(0, first)),
          parse_number(flag, text.substr(first + 1, second - first - 1)),
          wrap_angle(radians(parse_number(flag, text.substr(second + 1))))};
}

}  // namespace

void declare_simulation(Arguments& arguments, simulation::SimulatedWorldOptions& values) {
  arguments.options("recording", values.recording);
  arguments.options("simulation", values.simulation);
  arguments.options("frame", values.frame);
  arguments.options("sensor", values.sensor);
  arguments.options("free_space", values.free_space);
  arguments.options("odometry", values.odometry, "odometry");
  reject_ineffective_camera_options(arguments, values);
}

void reject_ineffective_camera_options(Arguments& arguments,
                                       const simulation::SimulatedWorldOptions& values) {
  reject_ineffective_options(arguments, values);
  const auto& simulation = values.simulation;
  arguments.reject_options_unless(
      {"--rows", "--elevation-low-deg", "--elevation-high-deg"},
      [&simulation] { return simulation.kind == 1; }, "without --kind panorama");
  arguments.reject_options_unless(
      {"--columns"}, [&simulation] { return simulation.kind == 1 || simulation.kind == 3; },
      "without --kind panorama or equirectangular");
  arguments.reject_options_unless(
      {"--vignetting"}, [&simulation] { return simulation.kind == 0 || simulation.kind == 2; },
      "with --kind panorama or equirectangular");
  arguments.reject_options_unless(
      {"--lens-seed", "--lens-distance-m"}, [&simulation] { return simulation.kind == 2; },
      "without --kind dual-fisheye");
}

void reject_ineffective_options(Arguments& arguments,
                                const simulation::SimulatedWorldOptions& values) {
  const auto& sensor = values.sensor;
  arguments.reject_options_unless(
      {"--moved-seed"}, [&values] { return values.simulation.scene.moved_objects > 0.0; },
      "without --moved-objects");
  arguments.reject_options_unless(
      {"--light-azimuth-rad"}, [&sensor] { return sensor.directional_light > 0.0; },
      "without --directional-light");
  arguments.reject_options_unless(
      {"--occluders"}, [&sensor] { return sensor.occluded_fraction > 0.0; },
      "without --occluded-fraction");
  arguments.reject_options_unless(
      {"--eight-bit"}, [&sensor] { return sensor.eight_bit; },
      "on images, whose values always have eight bits");
}

simulation::FindSetOption make_option_lookup(const Arguments& arguments) {
  return [&arguments](const std::string& section,
                      const std::string& name) -> std::optional<std::string> {
    if (!arguments.is_set(section, name)) return std::nullopt;
    return to_flag(name);
  };
}

Pose2 parse_free_pose(const std::string& flag, const std::string& text,
                      const simulation::FreeSpace& space) {
  const Pose2 pose = parse_pose(flag, text);
  if (!space.is_free(pose.position())) {
    throw UsageError(
        flag + " is at x " + format_number(pose.x_m) + " m, y " + format_number(pose.y_m) +
        " m, where the robot cannot stand; allowed: free places between x " +
        format_number(space.low().x_m) + " to " + format_number(space.high().x_m) + " m and y " +
        format_number(space.low().y_m) + " to " + format_number(space.high().y_m) + " m");
  }
  return pose;
}

}  // namespace panonav::command
