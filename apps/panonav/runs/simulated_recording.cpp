#include "runs/simulated_recording.hpp"

#include <algorithm>

namespace panonav::command {

void declare_simulation(Arguments& arguments, simulation::SimulatedWorldOptions& wanted) {
  arguments.options("recording", wanted.recording);
  arguments.options("simulation", wanted.simulation);
  arguments.options("frame", wanted.frame);
  arguments.options("sensor", wanted.sensor);
  arguments.options("free_space", wanted.free_space);
  arguments.options("odometry", wanted.odometry, "odometry");
  require_effects(arguments, wanted);
  const auto& simulation = wanted.simulation;
  arguments.used_only(
      {"--rows", "--columns", "--elevation-low-deg", "--elevation-high-deg"},
      [&simulation] { return simulation.kind == 1; }, "without --kind panorama");
  arguments.used_only(
      {"--vignetting"}, [&simulation] { return simulation.kind != 1; }, "with --kind panorama");
  arguments.used_only(
      {"--lens-seed", "--lens-distance-m"}, [&simulation] { return simulation.kind == 2; },
      "without --kind dual-fisheye");
}

void require_effects(Arguments& arguments, const simulation::SimulatedWorldOptions& wanted) {
  const auto& sensor = wanted.sensor;
  arguments.used_only(
      {"--moved-seed"}, [&wanted] { return wanted.simulation.scene.moved_objects > 0.0; },
      "without --moved-objects");
  arguments.used_only(
      {"--light-azimuth-rad"}, [&sensor] { return sensor.directional_light > 0.0; },
      "without --directional-light");
  arguments.used_only(
      {"--occluders"}, [&sensor] { return sensor.occluded_fraction > 0.0; },
      "without --occluded-fraction");
  arguments.used_only(
      {"--eight-bit"}, [&sensor] { return sensor.eight_bit; },
      "on pictures, whose values always have eight bits");
}

simulation::FindSetOption typed_options(const Arguments& arguments) {
  return [&arguments](const std::string& section,
                      const std::string& name) -> std::optional<std::string> {
    if (!arguments.given(section, name)) return std::nullopt;
    std::string flag = "--" + name;
    std::ranges::replace(flag, '_', '-');
    return flag;
  };
}

}  // namespace panonav::command
