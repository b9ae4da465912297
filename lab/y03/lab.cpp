#include "lab/y03/lab.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "lab/y03/steering.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/route/route_changes.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/line_camera.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::lab {

namespace {

constexpr double drive_step_m = 0.05;
// Fraction of the movable objects that are moved per trial; bounds and target of the changed
// fraction of the view.
constexpr double moved_object_fraction = 0.1;
constexpr double min_changed_fraction = 0.05;
constexpr double max_changed_fraction = 0.15;
constexpr double target_changed_fraction = 0.1;

std::vector<std::vector<float>> capture_lines(const simulation::Renderer& renderer,
                                              const std::vector<Pose2>& poses,
                                              const simulation::LineCamera& camera,
                                              std::uint64_t seed, Executor& executor) {
  return simulation::make_each(executor, poses.size(), [&](std::size_t i) {
    return simulation::capture_line(renderer, poses[i], camera, Random(seed, i).next());
  });
}

LineDrive simulate_line_drive(const simulation::Renderer& renderer, std::vector<Pose2> poses,
                              const simulation::LineCamera& camera, std::uint64_t seed,
                              Executor& executor) {
  LineDrive drive;
  drive.lines = capture_lines(renderer, poses, camera, seed, executor);
  const auto odometry = simulation::simulate_odometry(poses, {}, seed);
  drive.steps.emplace_back();
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    drive.steps.push_back(inverse(odometry[i - 1]) * odometry[i]);
  }
  drive.truth = std::move(poses);
  return drive;
}

std::vector<Pose2> make_straight_path(const Pose2& start, double length_m, double step_m) {
  std::vector<Pose2> poses;
  const auto steps = static_cast<int>(std::lround(length_m / step_m));
  for (int i = 0; i <= steps; ++i) poses.push_back(start * Pose2{i * step_m, 0.0, 0.0});
  return poses;
}

// Returns the start of a free path along the room, as near to the room's middle as possible;
// nullopt if there is none.
std::optional<Pose2> find_path_start(const simulation::FreeSpace& space) {
  const double x_m = 0.5 * (space.low().x_m + space.high().x_m) - 0.5 * lab_path_m;
  const double middle_m = 0.5 * (space.low().y_m + space.high().y_m);
  for (int i = 0; i <= 30; ++i) {
    for (const int side : {1, -1}) {
      const Point2 begin{x_m, middle_m + side * 0.05 * i};
      const Point2 end{x_m + lab_path_m, begin.y_m};
      if (space.is_free(begin) && space.is_free_between(begin, end))
        return Pose2{begin.x_m, begin.y_m, 0.0};
    }
  }
  return std::nullopt;
}

// Returns the prediction for the first line, off by 5 cm and 2 degrees.
Pose2 perturb_pose(const Pose2& truth) {
  return truth * Pose2{0.03, -0.04, radians(2.0)};
}

template <typename Fit>
DriveErrors track_drive(const LineDrive& drive, const Fit& fit) {
  DriveErrors errors;
  Pose2 pose = perturb_pose(drive.truth.front());
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    if (i > 0) pose = pose * drive.steps[i];
    const std::optional<Pose2> found = fit(drive.lines[i], pose);
    if (found) {
      pose = *found;
    } else {
      ++errors.missed;
    }
    errors.poses.push_back(pose);
    errors.position_m.push_back(distance(pose.position(), drive.truth[i].position()));
    errors.heading_rad.push_back(
        std::abs(angle_difference(pose.heading_rad, drive.truth[i].heading_rad)));
  }
  return errors;
}

struct ChangedLab {
  std::unique_ptr<simulation::Renderer> renderer;
  double fraction = 0.0;
};

// Returns the fraction of the directions in which two scenes differ by more than 5 of 255 grey
// levels without noise, at start, middle and end of a drive.
double measure_changed_fraction(const simulation::Renderer& before,
                                const simulation::Renderer& after, const std::vector<Pose2>& drive,
                                simulation::LineCamera camera) {
  camera.sensor.read_noise = 0.0;
  camera.sensor.full_well = 1e9;
  constexpr float max_unchanged_difference = 5.0F / 255.0F;
  std::size_t changed = 0;
  std::size_t all = 0;
  for (const std::size_t i : {std::size_t{0}, drive.size() / 2, drive.size() - 1}) {
    const auto a = simulation::capture_line(before, drive[i], camera, 0);
    const auto b = simulation::capture_line(after, drive[i], camera, 0);
    for (std::size_t c = 0; c < a.size(); ++c) {
      changed += std::abs(a[c] - b[c]) > max_unchanged_difference ? 1 : 0;
      ++all;
    }
  }
  return static_cast<double>(changed) / static_cast<double>(all);
}

// Moves objects until about a tenth of the view differs [Y03 section 5.1]. Several trials are
// needed, because a random tenth of the objects may change nothing or a large part of the view.
ChangedLab change_lab(std::uint64_t seed, const simulation::Renderer& before,
                      const std::vector<Pose2>& drive, const simulation::LineCamera& camera,
                      Executor& executor) {
  ChangedLab best;
  constexpr std::uint64_t max_trials = 30;
  for (std::uint64_t trial = 0; trial < max_trials; ++trial) {
    const simulation::Scene scene =
        simulation::make_scene("lab", {.seed = seed,
                                       .moved_objects = moved_object_fraction,
                                       .moved_seed = seed + 1 + 1000 * trial});
    auto after =
        std::make_unique<simulation::Renderer>(scene, simulation::RendererOptions{}, executor);
    const double fraction = measure_changed_fraction(before, *after, drive, camera);
    if (!best.renderer || std::abs(fraction - target_changed_fraction) <
                              std::abs(best.fraction - target_changed_fraction)) {
      best = {std::move(after), fraction};
    }
    if (best.fraction >= min_changed_fraction && best.fraction <= max_changed_fraction) break;
  }
  return best;
}

}  // namespace

LabRoute record_lab_route(std::uint64_t seed, const std::vector<double>& lateral_m,
                          Executor& executor) {
  const simulation::Scene scene = simulation::make_scene("lab", {.seed = seed});
  const simulation::FreeSpace space(scene, simulation::free_space_options(scene));
  LabRoute lab;
  lab.seed = seed;
  lab.renderer =
      std::make_shared<const simulation::Renderer>(scene, simulation::RendererOptions{}, executor);
  lab.camera_height_m = scene.camera_height_m;
  const simulation::Renderer& renderer = *lab.renderer;
  const simulation::LineCamera camera = simulation::make_line_camera(lab.camera_height_m);
  // If no path is free, the robot's camera passes above the objects.
  const double middle_m = 0.5 * (space.low().y_m + space.high().y_m);
  const double fallback_x_m = 0.5 * (space.low().x_m + space.high().x_m) - 0.5 * lab_path_m;
  lab.world_from_path = find_path_start(space).value_or(Pose2{fallback_x_m, middle_m, 0.0});
  const auto path = make_straight_path(lab.world_from_path, lab_path_m, lab_spacing_m);
  const auto lines = capture_lines(renderer, path, camera, seed * 7 + 1, executor);
  for (std::size_t i = 0; i < path.size(); ++i) lab.route.append(path[i], lines[i]);

  // The drive is 2 m long and crosses the path in its middle.
  const double turn = radians(30.0);
  const Pose2 start =
      lab.world_from_path * Pose2{0.5 * lab_path_m, 0.0, turn} * Pose2{-1.0, 0.0, 0.0};
  const auto across = make_straight_path(start, 2.0, drive_step_m);
  lab.across = simulate_line_drive(renderer, across, camera, seed * 7 + 2, executor);
  const ChangedLab changed = change_lab(seed, renderer, across, camera, executor);
  lab.across_changed =
      simulate_line_drive(*changed.renderer, across, camera, seed * 7 + 3, executor);
  lab.changed_fraction = changed.fraction;
  for (std::size_t i = 0; i < lateral_m.size(); ++i) {
    const Pose2 begin = lab.world_from_path * Pose2{0.3 * lab_path_m, lateral_m[i], 0.0};
    lab.lateral_drives.push_back(simulate_line_drive(renderer, make_straight_path(begin, 1.8, 0.2),
                                                     camera, seed * 7 + 4 + i, executor));
  }
  return lab;
}

RoutePanorama thin_route(const RoutePanorama& route, std::size_t every) {
  RoutePanorama result(route.columns());
  for (std::size_t i = 0; i < route.size(); i += every)
    result.append(route.poses()[i], route.line(i));
  return result;
}

RoutePanorama scale_route(const RoutePanorama& route, double factor) {
  RoutePanorama result(route.columns());
  const Point2 first = route.poses().front().position();
  for (std::size_t i = 0; i < route.size(); ++i) {
    Pose2 pose = route.poses()[i];
    pose.x_m = first.x_m + factor * (pose.x_m - first.x_m);
    pose.y_m = first.y_m + factor * (pose.y_m - first.y_m);
    result.append(pose, route.line(i));
  }
  return result;
}

DriveErrors follow_by_fit(const RouteLines& lines, const LineDrive& drive) {
  RouteChanges changes;
  std::size_t changed = 0;
  DriveErrors errors =
      track_drive(drive, [&](const std::vector<float>& line, const Pose2& predicted) {
        const auto fix = lines.fit(line, predicted);
        if (!fix) {
          changes.reset();
          return std::optional<Pose2>();
        }
        changed += changes.add(*fix).empty() ? 0 : 1;
        return std::optional(fix->pose);
      });
  errors.changed = changed;
  return errors;
}

DriveErrors follow_by_contours(const RouteContours& contours, const LineDrive& drive) {
  return track_drive(drive, [&](const std::vector<float>& line, const Pose2& predicted) {
    const auto fix = contours.fit(line, predicted);
    return fix && fix->converged ? std::optional(fix->pose) : std::nullopt;
  });
}

std::vector<Point2> goal_run_points() {
  return {{1.0, 0.0}, {2.0, -0.5}, {3.0, 0.0}};
}

GoalRun run_to_goals(const LabRoute& lab, const RouteLines& lines, std::uint64_t seed) {
  const simulation::LineCamera camera = simulation::make_line_camera(lab.camera_height_m);
  Random random(seed);
  const OdometryNoise wheels;
  std::vector<Point2> goals;
  for (const Point2 point : goal_run_points()) goals.push_back(lab.world_from_path * point);
  Pose2 robot{goals[0].x_m, goals[0].y_m, lab.world_from_path.heading_rad};
  Pose2 estimate = perturb_pose(robot);
  GoalRun run;
  constexpr double arrival_radius_m = 0.005;
  constexpr int max_steps = 200;
  std::size_t next = 1;
  Pose2 step;
  for (int i = 0; i < max_steps; ++i) {
    estimate = estimate * step;
    const auto line = simulation::capture_line(*lab.renderer, robot, camera, random.next());
    if (const auto fix = lines.fit(line, estimate)) estimate = fix->pose;
    run.truth.push_back(robot);
    run.estimate.push_back(estimate);
    if (distance(estimate.position(), goals[next]) < arrival_radius_m && ++next == goals.size()) {
      run.arrived = true;
      break;
    }
    step = steer_to(estimate, goals[next], {.step_m = drive_step_m});
    robot = robot * sample_step(step, wheels, random);
  }
  run.error_m = distance(robot.position(), goals.back());
  return run;
}

}  // namespace panonav::lab
