#include "panonav_simulation/exploration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav_simulation/make_each.hpp"

namespace panonav::simulation {

namespace {

std::vector<ExplorationReport::Range> read_ranges(MissionRobot& robot) {
  std::vector<ExplorationReport::Range> ranges;
  const auto lengths_m = robot.read_ranges();
  for (std::size_t i = 0; i < lengths_m.size(); ++i) {
    ranges.push_back({sensor_direction_rad(i), lengths_m[i], lengths_m[i] < max_range_m,
                      range_noise_m + range_noise_factor * lengths_m[i]});
  }
  return ranges;
}

// True if the robot homes from `current` at `pose` to the view: its direction is right.
bool is_home_vector_right(const HomingView& home, const Pose2& home_pose, const HomingView& current,
                          const Pose2& pose) {
  const Pose2 there = inverse(pose) * home_pose;
  constexpr double at_home_m = 0.1;  // where no direction is needed
  if (std::hypot(there.x_m, there.y_m) <= at_home_m) return true;
  const double error_rad =
      wrap_angle(home_vector(home, current).direction_rad() - std::atan2(there.y_m, there.x_m));
  return std::abs(error_rad) <= std::numbers::pi / 4.0;
}

}  // namespace

ExplorationRun run_exploration(const MissionPlace& place, Explorer& explorer,
                               const ExplorationRobot& options, const Pose2& start,
                               std::uint64_t seed, const ExplorationStep& step) {
  if (options.obstacles != ObstacleSensor::bumper && options.obstacles != ObstacleSensor::ranges) {
    throw ContractError("obstacle sensor", "another", "bumper or ranges");
  }
  MissionRobot robot(place, options.base, options.motion, start, seed, 0, options.obstacles);
  Random noise_of_views(seed, 2);
  ExplorationRun run;
  ExplorationReport report;
  std::vector<ExplorationReport::Range> ranges;
  for (;;) {
    run.path.push_back(robot.pose());
    if (options.obstacles == ObstacleSensor::ranges) ranges = read_ranges(robot);
    report.ranges = ranges;
    report.moved = robot.take_odometry();
    const auto decision =
        explorer.observe(sense_view(place, robot.pose(), noise_of_views.next()), report);
    run.end = decision.state;
    if (decision.memorise) run.views.push_back(robot.pose());
    if (step) step(decision, robot.pose());
    using State = ExplorationDecision::State;
    if (decision.state == State::exploring || decision.state == State::recovering) {
      run.explored_m = robot.travelled_m();
    }
    if (decision.state == State::done || decision.state == State::lost) break;
    report = {};
    const double heading_rad = robot.odometry().heading_rad;
    if (drive_step(robot, options.base, decision.direction_rad, decision.advance_m)) {
      report.contact_rad = robot.contact_rad();
      report.course_rad =
          options.base.drive == DriveKind::differential
              ? 0.0
              : wrap_angle(decision.direction_rad - (robot.odometry().heading_rad - heading_rad));
      robot.back_off();
    }
  }
  run.travelled_m = robot.travelled_m();
  run.contacts = robot.contacts();
  run.end_distance_m = distance(robot.pose().position(), start.position());
  return run;
}

Sweep plan_sweep(const FreeSpace& space, double radius_m) {
  Sweep sweep;
  for (const GridPosition& at : space.grid(std::numbers::sqrt2 * radius_m, GridOrder::zigzag)) {
    if (!sweep.views.empty()) {
      const Point2 before = sweep.views.back().position();
      if (space.is_free_between(before, at.position)) {
        sweep.length_m += distance(before, at.position);
      } else if (const auto path = space.shortest_path(before, at.position)) {
        sweep.length_m += path_length_m(*path);
      }
    }
    sweep.views.push_back({at.position.x_m, at.position.y_m, 0.0});
  }
  return sweep;
}

double measure_coverage(const MissionPlace& place, std::span<const Pose2> views, double radius_m,
                        double grid_m, std::uint64_t seed, Executor& executor) {
  const auto sense = [&](const Pose2& pose, std::uint64_t stream) {
    return homing_view(sense_view(place, pose, Random(seed, stream).next()));
  };
  const auto homes =
      make_each(executor, views.size(), [&](std::size_t i) { return sense(views[i], i); });
  const FreeSpace& space = *place.free_space;
  const auto grid = space.grid(grid_m);
  const auto covered = make_each(executor, grid.size(), [&](std::size_t i) {
    const std::uint64_t stream = views.size() + i;
    const Point2 position = grid[i].position;
    const Pose2 pose{position.x_m, position.y_m,
                     Random(seed, stream).uniform(-std::numbers::pi, std::numbers::pi)};
    const HomingView current = sense(pose, stream);
    for (std::size_t k = 0; k < views.size(); ++k) {
      if (distance(views[k].position(), position) > radius_m) continue;
      if (!space.is_free_between(position, views[k].position())) continue;
      if (is_home_vector_right(homes[k], views[k], current, pose)) return true;
    }
    return false;
  });
  if (grid.empty()) return 0.0;
  return static_cast<double>(std::ranges::count(covered, true)) / static_cast<double>(grid.size());
}

}  // namespace panonav::simulation
