#include "runs/ros2_robot.hpp"

#include <cmath>

#include "cli/stop_signals.hpp"
#include "panonav/core/text.hpp"
#include "panonav_ros2/simulated_robot.hpp"
#include "panonav_simulation/obstacle_sense.hpp"

namespace panonav::command {

struct Ros2Robot::Options {
  ros2::SimulatedRobotOptions robot;
};

Ros2Robot::Ros2Robot() : options_(std::make_shared<Options>()) {}

void Ros2Robot::declare(Arguments& arguments, const std::function<bool()>& is_used) {
  arguments.options("robot", options_->robot);
  arguments.reject_options_unless({"[robot]"}, is_used, "without --ros2");
}

ExitCode Ros2Robot::run(const simulation::SimulatedWorld& world, Session& session) const {
  const auto seed = static_cast<std::uint64_t>(world.options().simulation.scene.seed);
  Random random(seed, 0);
  const simulation::Scene& scene = world.scene();
  Pose2 start = world.free_space().random_pose(random);
  if (scene.tour.size() > 1 && world.free_space().is_free(scene.tour.front())) {
    const Point2 direction{scene.tour[1].x_m - scene.tour[0].x_m,
                           scene.tour[1].y_m - scene.tour[0].y_m};
    start = {scene.tour[0].x_m, scene.tour[0].y_m, std::atan2(direction.y_m, direction.x_m)};
  }
  const double robot_radius_m = world.options().free_space.robot_radius_m;
  ros2::SimulatedRobot robot(
      {.node = "panonav_simulation"}, options_->robot,
      {start, [&](Point2 place) { return world.free_space().is_free(place); },
       [&](const Pose2& pose, std::uint64_t number) {
         return world.capture_image(pose, number, session.executor());
       },
       [&](const Pose2& pose, std::uint64_t number) {
         Random noise(number);
         const auto ranges_m =
             simulation::measure_ranges(world.free_space(), nullptr, pose, noise, robot_radius_m);
         return std::vector<double>(ranges_m.begin(), ranges_m.end());
       },
       simulation::max_range_m, robot_radius_m},
      world.options().odometry, seed, [&](const std::string& line) { session.note(line); });
  const StopSignals signals([&] { robot.stop(); });
  session.note("panonav simulate: a robot is in " + scene.name + " at " +
               format_fixed(start.x_m, 2) + ", " + format_fixed(start.y_m, 2) +
               "; cmd_vel drives it, and Ctrl-C stops it");
  robot.run();
  return ExitCode::done;
}

}  // namespace panonav::command
