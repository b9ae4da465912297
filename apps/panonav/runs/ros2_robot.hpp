#pragma once

#include <functional>
#include <memory>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

/// The simulated robot of `simulate --ros2`, controlled by ROS 2 messages. In a build without
/// Cyclone DDS `run` throws.
class Ros2Robot {
 public:
  Ros2Robot();
  /// Declares the options of the robot; they are rejected if `is_used` returns false.
  void declare(Arguments& arguments, const std::function<bool()>& is_used);
  /// Lets the robot drive in the world until Ctrl-C. Throws Error in a build without Cyclone DDS.
  ExitCode run(const simulation::SimulatedWorld& world, Session& session) const;

 private:
  struct Options;
  std::shared_ptr<Options> options_;
};

}  // namespace panonav::command
