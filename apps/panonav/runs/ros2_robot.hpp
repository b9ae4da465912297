#pragma once

#include <functional>
#include <memory>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav_simulation/simulated_world.hpp"

namespace panonav::command {

/// The robot of `simulate --ros2`, which obeys ROS 2. A build without Cyclone DDS has none.
class Ros2Robot {
 public:
  Ros2Robot();
  /// Declares the options of the robot, which count only where `is_used`.
  void declare(Arguments& arguments, const std::function<bool()>& is_used);
  /// Lets the robot drive in the world until Ctrl-C. Throws Error in a build without Cyclone DDS.
  ExitCode run(const simulation::SimulatedWorld& world, Session& session) const;

 private:
  struct Options;
  std::shared_ptr<Options> options_;
};

}  // namespace panonav::command
