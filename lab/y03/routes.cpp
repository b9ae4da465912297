#include "lab/y03/routes.hpp"
#include "panonav_simulation/make_each.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "lab/y03/steering.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/path_follower.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::lab {

namespace {

constexpr double side_clearance_m = 0.1;

// Returns the free space with clearance on both sides of the robot; all free space if there is
// none.
simulation::FreeSpace make_wide_free_space(const RouteScene& place) {
  simulation::FreeSpaceOptions options = simulation::free_space_options(place.scene);
  options.robot_radius_m += side_clearance_m;
  try {
    return simulation::FreeSpace(place.scene, options);
  } catch (const ContractError&) {
    return *place.free_space;
  }
}

// Returns the path with each position replaced by the mean of up to `reach` positions on each side.
std::vector<Pose2> smooth_path(const std::vector<Pose2>& poses, std::size_t reach) {
  std::vector<Pose2> result = poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t half = std::min({reach, i, poses.size() - 1 - i});
    double x = 0.0;
    double y = 0.0;
    for (std::size_t j = i - half; j <= i + half; ++j) {
      x += poses[j].x_m;
      y += poses[j].y_m;
    }
    const auto n = static_cast<double>(2 * half + 1);
    result[i] = {x / n, y / n, 0.0};
  }
  return result;
}

// True if the robot can drive the straight line without contact.
bool has_clear_line(const RouteScene& place, Point2 from, Point2 to) {
  constexpr double fine_spacing_m = 0.025;
  return place.free_space->clearance_m(from) >= place.scene.robot_radius_m &&
         simulation::has_room_between(*place.free_space, place.scene.robot_radius_m, from, to,
                                      fine_spacing_m);
}

// Returns the smallest clearance of the poses of a path.
double min_clearance_m(const RouteScene& place, const std::vector<Pose2>& poses) {
  double min_m = std::numeric_limits<double>::infinity();
  for (const Pose2& pose : poses) {
    min_m = std::min(min_m, place.free_space->clearance_m(pose.position()));
  }
  return min_m;
}

double direction(Point2 from, Point2 to) {
  return std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
}

// Returns the distance from the part of the path within 1.5 m of the path length `along_m`; other
// parts of the route may pass nearby and must not count.
double distance_from_expected_part_m(Point2 robot, std::span<const Pose2> poses, double along_m) {
  constexpr double reach_m = 1.5;
  std::size_t begin = 0;
  std::size_t end = poses.size();
  double path_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    path_m += distance(poses[i - 1].position(), poses[i].position());
    if (path_m < along_m - reach_m) begin = i;
    if (path_m > along_m + reach_m) {
      end = i + 1;
      break;
    }
  }
  return simulation::distance_from_route_m(robot, poses.subspan(begin, end - begin));
}

// Samples a start at a lateral offset from the route's start, with a clear straight line to the
// route; the route's start if there is none.
Pose2 sample_start_with_offset(const RouteScene& place, std::span<const Point2> path,
                               const Pose2& start, double lateral_offset_m, Random& random) {
  const std::size_t ahead = std::min<std::size_t>(3, path.size() - 1);
  const double side = random.uniform() < 0.5 ? 1.0 : -1.0;
  for (const double angle :
       {0.5 * std::numbers::pi, -0.5 * std::numbers::pi, 0.75 * std::numbers::pi,
        -0.75 * std::numbers::pi, 0.25 * std::numbers::pi, -0.25 * std::numbers::pi}) {
    const Pose2 there =
        start * Pose2{lateral_offset_m * std::cos(side * angle),
                      lateral_offset_m * std::sin(side * angle), random.normal(0.0, radians(5.0))};
    if (has_clear_line(place, there.position(), path.front()) &&
        has_clear_line(place, there.position(), path[ahead])) {
      return there;
    }
  }
  return start;
}

// Returns a step around an obstacle: half of the planned length, in the direction nearest to the
// planned one (15 degrees apart) that is free; nullopt if there is none. Without obstacle returns
// `planned`.
std::optional<Pose2> find_step_past_obstacle(const RouteScene& place, const Pose2& robot,
                                             const Pose2& planned) {
  if (has_clear_line(place, robot.position(), (robot * planned).position())) return planned;
  const double half_m = 0.5 * std::hypot(planned.x_m, planned.y_m);
  constexpr int directions_per_side = 11;
  const auto step_along = [&](double direction_rad) {
    return Pose2{0.0, 0.0, direction_rad} * Pose2{half_m, 0.0, 0.0};
  };
  const auto free_direction =
      simulation::find_open_direction(0.0, directions_per_side, 0, [&](double direction_rad) {
        return has_clear_line(place, robot.position(),
                              (robot * step_along(direction_rad)).position());
      });
  return free_direction ? std::optional(step_along(free_direction->direction_rad)) : std::nullopt;
}

// Returns a step of a widening spiral that searches for the route; it is 0.5 m wide after about 25
// steps.
Pose2 spiral_step(int step) {
  const double turn = 1.0 / (1.0 + 0.15 * step);
  constexpr double step_m = 0.1;
  return {step_m * std::cos(0.5 * turn), step_m * std::sin(0.5 * turn), turn};
}

}  // namespace

RouteScene make_route_scene(simulation::Scene scene, const std::string& name, Executor& executor) {
  const double height_m = scene.camera_height_m;
  return {simulation::make_place(std::move(scene), executor), name,
          simulation::make_line_camera(height_m)};
}

std::vector<Pose2> plan_curved_route(const RouteScene& place, double length_m, double spacing_m,
                                     std::uint64_t seed) {
  require(length_m > 0.0, "length of a route", length_m, "> 0");
  require(spacing_m > 0.0, "spacing of a route", spacing_m, "> 0");
  const simulation::FreeSpace space = make_wide_free_space(place);
  Random random(seed, 1);
  std::vector<Pose2> corners{space.random_pose(random)};
  double heading = corners.front().heading_rad;
  double path_m = 0.0;
  int sharp_turn_trials = 0;
  while (path_m < length_m) {
    const auto leg =
        space.shortest_path(corners.back().position(), space.random_pose(random).position());
    if (!leg || leg->size() < 2 || distance(leg->front(), leg->back()) < 0.5) continue;
    // Avoid turns of more than 100 degrees, for at most 50 trials.
    constexpr int max_sharp_turn_trials = 50;
    const double turn = angle_difference(direction((*leg)[0], (*leg)[1]), heading);
    if (corners.size() > 1 && std::abs(turn) > radians(100.0) &&
        ++sharp_turn_trials < max_sharp_turn_trials)
      continue;
    sharp_turn_trials = 0;
    for (std::size_t i = 1; i < leg->size(); ++i) {
      path_m += distance((*leg)[i - 1], (*leg)[i]);
      corners.push_back({(*leg)[i].x_m, (*leg)[i].y_m, 0.0});
    }
    heading = direction((*leg)[leg->size() - 2], leg->back());
  }
  constexpr double fine_spacing_m = 0.05;
  const std::vector<Pose2> sharp = simulation::resample(corners, fine_spacing_m);
  // Round the corners as far as the free space allows, with a margin of one map cell.
  constexpr double cell_m = 0.025;
  const double min_kept_clearance_m =
      std::min(min_clearance_m(place, sharp) - cell_m,
               place.scene.robot_radius_m + side_clearance_m - cell_m);
  std::vector<Pose2> poses = sharp;
  for (const std::size_t reach : {10U, 7U, 5U, 3U, 2U}) {
    std::vector<Pose2> round = smooth_path(smooth_path(sharp, reach), reach);
    if (min_clearance_m(place, round) < min_kept_clearance_m) continue;
    poses = std::move(round);
    break;
  }
  poses = simulation::resample(poses, spacing_m);
  const auto max_poses = static_cast<std::size_t>(std::floor(length_m / spacing_m)) + 1;
  if (poses.size() > max_poses) poses.resize(max_poses);
  simulation::face_path(poses);
  return poses;
}

RoutePanorama record_route(const RouteScene& place, const std::vector<Pose2>& poses,
                           std::uint64_t seed, Executor& executor) {
  auto lines = simulation::make_each(executor, poses.size(), [&](std::size_t i) {
    return simulation::capture_line(*place.renderer, poses[i], place.camera,
                                    Random(seed, i).next());
  });
  RoutePanorama route(place.camera.line.columns);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    static_cast<void>(route.append(poses[i], std::span<const float>(lines[i])));
  }
  return route;
}

Pose2 ScaleErrorWheels::execute(const Pose2& commanded, Random& random) const {
  const double travel_m = travel * std::hypot(commanded.x_m, commanded.y_m);
  const double turned = turn * commanded.heading_rad;
  const Pose2 step{travel_m * std::cos(0.5 * turned), travel_m * std::sin(0.5 * turned), turned};
  return sample_step(step, noise, random);
}

namespace {

/// Adds the fix of a line that was taken at the true pose `robot`; nullopt: off the route.
void add_line(RouteRun& run, const Pose2& robot, const std::optional<RouteLineFix>& fix) {
  run.truth.push_back(robot);
  run.line_fixes.push_back(fix);
  if (fix) {
    run.position_m.push_back(distance(fix->pose.position(), robot.position()));
  } else {
    ++run.off_route;
  }
}

}  // namespace

RouteRun repeat_route(const RouteScene& place, RouteTracker tracker, const RouteRunOptions& options,
                      std::uint64_t seed) {
  std::vector<Pose2> poses(tracker.lines().poses().begin(), tracker.lines().poses().end());
  if (options.back) {
    std::ranges::reverse(poses);
    for (Pose2& pose : poses) pose.heading_rad = wrap_angle(pose.heading_rad + std::numbers::pi);
  }
  const std::vector<Point2> path = positions_of(poses);
  const Pose2 start = poses.front();
  Random random(seed, 1);
  Random noise_of_lines(seed, 2);
  const auto scale = [&] {
    return 1.0 + (random.uniform() < 0.5 ? -1.0 : 1.0) * options.wheel_scale_error;
  };
  ScaleErrorWheels wheels;
  wheels.travel = scale();
  wheels.turn = scale();
  Pose2 robot = sample_start_with_offset(place, path, start, options.start_offset_m, random);
  tracker.set_pose(start);
  PathFollower follower(path);
  const auto max_steps = static_cast<int>(3.0 * follower.length_m() / options.step_m) + 50;
  RouteRun run;
  Pose2 commanded;
  // Odometry bridges up to three lines without a fix; then the robot searches for the route.
  constexpr int max_lines_without_fix = 4;
  int lines_without_fix = 0;
  for (int step = 0; step < max_steps; ++step) {
    const auto line =
        simulation::capture_line(*place.renderer, robot, place.camera, noise_of_lines.next());
    std::optional<RouteLineFix> fix;
    if (const auto found = tracker.track(line, commanded))
      fix = RouteLineFix{found->pose, found->along_m};
    lines_without_fix = fix ? 0 : lines_without_fix + 1;
    run.lateral_m.push_back(
        distance_from_expected_part_m(robot.position(), poses, follower.along_m()));
    add_line(run, robot, fix);
    const Pose2 estimate = tracker.pose().value_or(start);
    const auto target = follower.next_target(estimate.position());
    if (!target) {
      run.arrived = true;
      break;
    }
    const Pose2 planned = lines_without_fix < max_lines_without_fix
                              ? steer_to(estimate, *target, {.step_m = options.step_m})
                              : spiral_step(lines_without_fix - max_lines_without_fix);
    const auto free_step = find_step_past_obstacle(place, robot, planned);
    if (!free_step) {
      run.blocked = true;
      break;
    }
    commanded = *free_step;
    run.obstacle_steps += static_cast<std::size_t>(commanded != planned);
    const Pose2 there = robot * wheels.execute(commanded, random);
    // Wheel errors may lead the robot into an obstacle: then it turns, but does not move.
    if (has_clear_line(place, robot.position(), there.position())) {
      robot = there;
    } else {
      robot.heading_rad = there.heading_rad;
      ++run.obstacle_steps;
    }
  }
  run.end_distance_m = distance(robot.position(), path.back());
  return run;
}

std::vector<viewer::MapLayer> make_route_layers(std::span<const Pose2> poses,
                                                std::span<const RouteRun> runs) {
  viewer::MapLayer route{
      .label = "stored route", .colour = viewer::PlotColour::black, .lines = {positions_of(poses)}};
  viewer::MapLayer forward{.label = "driven forward", .colour = viewer::PlotColour::blue};
  viewer::MapLayer back{.label = "driven back", .colour = viewer::PlotColour::green};
  viewer::MapLayer starts{.label = "starts, 0.3 m beside the route",
                          .colour = viewer::PlotColour::orange};
  viewer::MapLayer lost{.label = "lost", .colour = viewer::PlotColour::vermilion};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    (i % 2 == 0 ? forward : back).lines.push_back(positions_of(runs[i].truth));
    starts.circles.push_back(runs[i].truth.front().position());
    if (!runs[i].has_completed()) lost.crosses.push_back(runs[i].truth.back().position());
  }
  return {route, forward, back, starts, lost};
}

}  // namespace panonav::lab
