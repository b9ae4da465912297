#include "panonav/core/error.hpp"
#include "runs/ros2_robot.hpp"

namespace panonav::command {

struct Ros2Robot::Options {};

Ros2Robot::Ros2Robot() = default;

void Ros2Robot::declare(Arguments&, const std::function<bool()>&) {}

ExitCode Ros2Robot::run(const simulation::SimulatedWorld&, Session&) const {
  throw Error(
      "this panonav was built without Cyclone DDS; install cyclonedds-dev and build it again");
}

}  // namespace panonav::command
