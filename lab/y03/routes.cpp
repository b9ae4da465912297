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
#include "panonav/motion/velocity.hpp"
#include "panonav_simulation/obstacle_sense.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/people.hpp"
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

/// A robot that repeats a route: its wheels err, and it knows only the obstacles that its sensor
/// measured.
class RouteRobot {
 public:
  struct Step {
    Pose2 odometry;                 ///< the commands that it executed, up to a contact
    bool has_met_obstacle = false;  ///< it touched or avoided an obstacle
    bool is_stopped = false;        ///< obstacles in all directions
  };

  RouteRobot(const RouteScene& place, const ScaleErrorWheels& wheels, const Pose2& start,
             simulation::ObstacleSensor sensor, std::uint64_t seed)
      : place_(place),
        wheels_(wheels),
        pose_(start),
        sensor_(sensor),
        nobody_(place.free_space, 0, seed),
        noise_of_ranges_(seed, 5) {
    if (sensor == simulation::ObstacleSensor::camera) {
      simulation::require_floor_camera(place.floor_camera.get());
      floor_.emplace(*place.floor_camera, nullptr, seed);
    }
  }

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }

  /// Drives a planned step, or half of its length in the nearest direction that is open as far as
  /// the sensor knows. Contact ends the step.
  Step drive(const Pose2& planned, Random& random) {
    known_.advance(std::hypot(planned.x_m, planned.y_m) / BaseOptions{}.speed_m_s);
    if (sensor_ == simulation::ObstacleSensor::ranges) {
      known_.add_ranges(
          simulation::measure_ranges(*place_.free_space, nullptr, pose_, noise_of_ranges_));
    }
    unscanned_m_ += std::hypot(planned.x_m, planned.y_m);
    if (floor_ && unscanned_m_ >= scan_spacing_m) {
      known_.add_scan(floor_->scan(pose_));
      unscanned_m_ = 0.0;
    }
    auto way = find_open_way(planned);
    if (!way && sensor_ != simulation::ObstacleSensor::truth) {
      // Contacts are known to 22.5 degrees only, so it feels again before it gives up.
      known_ = {};
      way = find_open_way(planned);
    }
    if (!way || contacts_ > 2 * directions_per_side) return {{}, true, true};
    Step step{.has_met_obstacle = way->rotation_rad != 0.0};
    if (way->rotation_rad != 0.0) {
      const Pose2 rotation{0.0, 0.0, way->rotation_rad};
      pose_ = pose_ * wheels_.execute(rotation, random);
      report_motion(rotation, step.odometry);
    }
    const bool has_touched = !drive_until_contact(way->advance, random, step.odometry);
    step.has_met_obstacle |= has_touched;
    contacts_ = has_touched ? contacts_ + 1 : 0;
    return step;
  }

 private:
  static constexpr int directions_per_side = 11;
  // Two steps: the nearest floor that it sees is 0.4 m away.
  static constexpr double scan_spacing_m = 0.19;
  /// A rotation on the spot and a step after it.
  struct Way {
    double rotation_rad = 0.0;
    Pose2 advance;
  };

  [[nodiscard]] bool is_open(double direction_rad, double length_m, bool heeds_ranges) const {
    if (sensor_ != simulation::ObstacleSensor::truth) {
      return known_.is_open(direction_rad, length_m, place_.scene.robot_radius_m, heeds_ranges);
    }
    const Point2 there =
        pose_ * Point2{length_m * std::cos(direction_rad), length_m * std::sin(direction_rad)};
    return has_clear_line(place_, pose_.position(), there);
  }

  std::optional<Way> find_open_way(const Pose2& planned) {
    const double length_m = std::hypot(planned.x_m, planned.y_m);
    const double direct_rad = std::atan2(planned.y_m, planned.x_m);
    // Between noisy ranges a door may seem too narrow; the bumper tells.
    for (const bool heeds_ranges : {true, false}) {
      if (length_m == 0.0 || is_open(direct_rad, length_m, heeds_ranges)) {
        detour_side_ = 0;
        return Way{0.0, planned};
      }
      for (const int side : {detour_side_, -detour_side_}) {
        const auto open = simulation::find_open_direction(
            0.0, directions_per_side, side, [&](double direction_rad) {
              return is_open(direction_rad, 0.5 * length_m, heeds_ranges);
            });
        if (!open) continue;
        detour_side_ = open->side;
        return Way{open->direction_rad, {0.5 * length_m, 0.0, 0.0}};
      }
    }
    return std::nullopt;
  }

  /// Drives a step, and after a contact a little back; adds to `odometry` what the wheels report.
  bool drive_until_contact(const Pose2& advance, Random& random, Pose2& odometry) {
    const Pose2 before = pose_;
    const Pose2 after = before * wheels_.execute(advance, random);
    const auto point_at = [&](double fraction) {
      return Point2{before.x_m + fraction * (after.x_m - before.x_m),
                    before.y_m + fraction * (after.y_m - before.y_m)};
    };
    const auto is_clear_to = [&](double fraction) {
      return has_clear_line(place_, before.position(), point_at(fraction));
    };
    double fraction = is_clear_to(1.0) ? 1.0 : 0.0;
    constexpr int halvings = 10;  // to a tenth of a millimetre
    for (int i = 1; i <= halvings && fraction < 1.0; ++i) {
      const double further = fraction + std::exp2(-i);
      if (is_clear_to(further)) fraction = further;
    }
    pose_ = {point_at(fraction).x_m, point_at(fraction).y_m, after.heading_rad};
    report_motion({fraction * advance.x_m, fraction * advance.y_m, advance.heading_rad}, odometry);
    if (fraction == 1.0) return true;
    const double radius_m = place_.scene.robot_radius_m;
    const double contact_rad =
        simulation::sense_contact_rad(*place_.free_space, nobody_, pose_, radius_m);
    known_.add({radius_m * std::cos(contact_rad), radius_m * std::sin(contact_rad)});
    // The side of a contact is known to 22.5 degrees only: if one more follows, it is its course
    // that is blocked.
    if (contacts_ > 0) known_.add({radius_m, 0.0});
    // A tenth of the radius leaves room for driving along a wall.
    const Pose2 back{-0.1 * radius_m, 0.0, 0.0};
    if (has_clear_line(place_, pose_.position(), (pose_ * back).position())) {
      pose_ = pose_ * back;
      report_motion(back, odometry);
    }
    return false;
  }

  void report_motion(const Pose2& motion, Pose2& odometry) {
    odometry = odometry * motion;
    known_.move(motion);
    if (floor_) floor_->move(motion, pose_);
  }

  const RouteScene& place_;
  ScaleErrorWheels wheels_;
  Pose2 pose_;
  simulation::ObstacleSensor sensor_;
  simulation::People nobody_;
  Random noise_of_ranges_;
  std::optional<simulation::FloorSensor> floor_;
  double unscanned_m_ = 0.0;  // commanded distance since the last scan
  simulation::ObstacleMemory known_;
  int detour_side_ = 0;  // side of the last detour: 1 left, -1 right, 0 none
  int contacts_ = 0;     // consecutive steps that ended in contact
};

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
  RouteRobot robot(place, wheels,
                   sample_start_with_offset(place, path, start, options.start_offset_m, random),
                   options.sensor, seed);
  tracker.set_pose(start);
  PathFollower follower(path);
  const auto max_steps = static_cast<int>(3.0 * follower.length_m() / options.step_m) + 50;
  RouteRun run;
  Pose2 commanded;
  // Odometry bridges up to three lines without a fix; then the robot searches for the route.
  constexpr int max_lines_without_fix = 4;
  int lines_without_fix = 0;
  for (int step = 0; step < max_steps; ++step) {
    const Pose2 here = robot.pose();
    const auto line =
        simulation::capture_line(*place.renderer, here, place.camera, noise_of_lines.next());
    std::optional<RouteLineFix> fix;
    if (const auto found = tracker.track(line, commanded))
      fix = RouteLineFix{found->pose, found->along_m};
    lines_without_fix = fix ? 0 : lines_without_fix + 1;
    run.lateral_m.push_back(
        distance_from_expected_part_m(here.position(), poses, follower.along_m()));
    add_line(run, here, fix);
    const Pose2 estimate = tracker.pose().value_or(start);
    const auto target = follower.next_target(estimate.position());
    if (!target) {
      run.arrived = true;
      break;
    }
    const Pose2 planned = lines_without_fix < max_lines_without_fix
                              ? steer_to(estimate, *target, {.step_m = options.step_m})
                              : spiral_step(lines_without_fix - max_lines_without_fix);
    const auto driven = robot.drive(planned, random);
    if (driven.is_stopped) {
      run.blocked = true;
      break;
    }
    commanded = driven.odometry;
    run.obstacle_steps += driven.has_met_obstacle ? 1 : 0;
  }
  run.end_distance_m = distance(robot.pose().position(), path.back());
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
