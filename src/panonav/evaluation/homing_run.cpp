#include "panonav/evaluation/homing_run.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

namespace {

constexpr double feeler_spacing_rad = std::numbers::pi / 12.0;
constexpr int feelers_each_side = 8;

Point2 ahead(const Pose2& pose, double direction_rad, double distance_m) {
  return pose * Point2{distance_m * std::cos(direction_rad), distance_m * std::sin(direction_rad)};
}

// Length of the free part of the straight way, at most `distance_m`.
double free_way_m(const FreeSpace& space, Point2 from, Point2 to) {
  if (space.is_free_between(from, to)) return distance(from, to);
  double low = 0.0;
  double high = 1.0;
  constexpr int halvings = 12;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    const Point2 there{from.x_m + middle * (to.x_m - from.x_m),
                       from.y_m + middle * (to.y_m - from.y_m)};
    (space.is_free_between(from, there) ? low : high) = middle;
  }
  return low * distance(from, to);
}

// The robot's base: does what it is told as well as it can.
class SimulatedRobot {
 public:
  SimulatedRobot(const FreeSpace& space, const HomingRunOptions& options, const Pose2& start,
                 Random random)
      : space_(space), options_(options), pose_(start), random_(random) {}

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }

  // The direction in which the robot goes when it wants to go `advance_m` along `wanted_rad`;
  // empty when there is none.
  [[nodiscard]] std::optional<double> free_direction(double wanted_rad, double advance_m) {
    const auto is_open = [&](double direction_rad, double distance_m) {
      return space_.is_free_between(pose_.position(), ahead(pose_, direction_rad, distance_m));
    };
    if (is_open(wanted_rad, advance_m)) {
      side_ = 0;
      return wanted_rad;
    }
    if (options_.obstacles == ObstacleRule::stop) return std::nullopt;
    const int kept = side_;
    for (int i = 1; i <= feelers_each_side; ++i) {
      for (const int side : {1, -1}) {
        if (kept != 0 && side != kept) continue;
        const double direction_rad = wanted_rad + side * i * feeler_spacing_rad;
        if (!is_open(direction_rad, 0.5 * advance_m)) continue;
        side_ = side;
        return direction_rad;
      }
    }
    if (kept == 0) return std::nullopt;
    side_ = -kept;
    for (int i = 1; i <= feelers_each_side; ++i) {
      const double direction_rad = wanted_rad + side_ * i * feeler_spacing_rad;
      if (is_open(direction_rad, 0.5 * advance_m)) return direction_rad;
    }
    return std::nullopt;
  }

  // Returns false when something stood in the way.
  bool go(double direction_rad, double advance_m) {
    const Pose2 before = pose_;
    Pose2 after;
    if (options_.motion.drive == DriveKind::differential) {
      const Pose2 turned =
          sample_step({0.0, 0.0, wrap_angle(direction_rad)}, options_.motion, random_);
      pose_.heading_rad = wrap_angle(pose_.heading_rad + turned.heading_rad);
      after = pose_ * sample_step({advance_m, 0.0, 0.0}, options_.motion, random_);
    } else {
      after = pose_ * sample_step({advance_m * std::cos(direction_rad),
                                   advance_m * std::sin(direction_rad), 0.0},
                                  options_.motion, random_);
    }
    const double way_m = distance(before.position(), after.position());
    const double free_m = free_way_m(space_, before.position(), after.position());
    if (free_m >= way_m) {
      pose_ = after;
      return true;
    }
    const double share = way_m > 0.0 ? free_m / way_m : 0.0;
    pose_.x_m = before.x_m + share * (after.x_m - before.x_m);
    pose_.y_m = before.y_m + share * (after.y_m - before.y_m);
    pose_.heading_rad = after.heading_rad;
    return false;
  }

 private:
  const FreeSpace& space_;
  const HomingRunOptions& options_;
  Pose2 pose_;
  Random random_;
  int side_ = 0;  // on which it goes past something: 1 left, -1 right
};

}  // namespace

HomingPlace make_homing_place(Scene scene, HomingCamera camera, Executor& executor) {
  HomingPlace place;
  place.scene = std::move(scene);
  place.free_space =
      std::make_shared<const FreeSpace>(place.scene, free_space_options(place.scene));
  place.renderer = std::make_shared<const Renderer>(place.scene, RendererOptions{}, executor);
  camera.frame.camera_height_m = place.scene.camera_height_m;
  place.camera = camera;
  return place;
}

HomingView take_homing_view(const HomingPlace& place, const Pose2& pose, std::uint64_t seed) {
  Executor here(1);
  const HomingCamera& camera = place.camera;
  return homing_view(compute_signature(take_panorama(*place.renderer, pose, camera.rendering,
                                                     camera.frame, camera.sensor, seed, here),
                                       camera.components));
}

std::string_view name_of(HomingRunEnd end) {
  switch (end) {
    case HomingRunEnd::arrived:
      return "arrived";
    case HomingRunEnd::wrong_place:
      return "wrong place";
    case HomingRunEnd::blocked:
      return "blocked";
    case HomingRunEnd::exhausted:
      return "exhausted";
  }
  return "";
}

bool HomingRun::succeeds(double radius_m) const noexcept {
  return end == HomingRunEnd::arrived && end_distance_m <= radius_m;
}

HomingRun run_home(const HomingPlace& place, const HomingView& home, const Pose2& goal,
                   const Pose2& start, const HomingRunOptions& options, std::uint64_t seed) {
  validate(options.motion);
  if (!place.free_space->is_free(start.position())) {
    throw ContractError("start of a run home", "an obstacle", "a free place");
  }
  HomingPursuit pursuit(home, options.pursuit, options.vector);
  SimulatedRobot robot(*place.free_space, options, start, Random(seed, 1));
  Random noise_of_views(seed, 2);
  HomingRun run;
  run.goal = goal;
  for (;;) {
    const HomingView view = take_homing_view(place, robot.pose(), noise_of_views.next());
    const PursuitDecision decision = pursuit.decide(view);
    run.path.push_back(robot.pose());
    run.vectors.push_back(decision.vector);
    const auto finish = [&](HomingRunEnd end) {
      run.end = end;
      run.end_distance_m = distance(robot.pose().position(), goal.position());
      run.end_difference = decision.difference.value_or(image_difference(home, view));
      return run;
    };
    switch (decision.state) {
      case PursuitState::moving:
        break;
      case PursuitState::arrived:
        return finish(HomingRunEnd::arrived);
      case PursuitState::wrong_place:
        return finish(HomingRunEnd::wrong_place);
      case PursuitState::exhausted:
        return finish(HomingRunEnd::exhausted);
    }
    const auto direction_rad = robot.free_direction(decision.turn_rad, decision.advance_m);
    run.met_obstacle = run.met_obstacle || direction_rad != decision.turn_rad;
    const bool moved = robot.go(direction_rad.value_or(decision.turn_rad), decision.advance_m);
    if (!direction_rad || (!moved && options.obstacles == ObstacleRule::stop)) {
      run.met_obstacle = true;
      run.path.push_back(robot.pose());
      return finish(HomingRunEnd::blocked);
    }
  }
}

std::vector<HomingTask> random_homing_tasks(const HomingPlace& place, int count, double radius_m,
                                            std::uint64_t seed) {
  require(count >= 1, "runs home", count, ">= 1");
  require(radius_m > 0.0, "radius of the starts", radius_m, "> 0");
  std::vector<HomingTask> tasks;
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    HomingTask task;
    task.goal = place.free_space->random_pose(random);
    do {
      const double way_m = radius_m * std::sqrt(random.uniform());
      const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
      task.start = {task.goal.x_m + way_m * std::cos(direction_rad),
                    task.goal.y_m + way_m * std::sin(direction_rad),
                    wrap_angle(random.uniform(-std::numbers::pi, std::numbers::pi))};
    } while (!place.free_space->is_free(task.start.position()));
    tasks.push_back(task);
  }
  return tasks;
}

std::vector<HomingRun> run_home(const HomingPlace& place, const std::vector<HomingTask>& tasks,
                                const HomingRunOptions& options, std::uint64_t seed,
                                Executor& executor) {
  std::vector<HomingRun> runs(tasks.size());
  executor.for_chunks(tasks.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      std::uint64_t task_seed = Random(seed, i).next();
      const HomingView home = take_homing_view(place, tasks[i].goal, task_seed);
      runs[i] = run_home(place, home, tasks[i].goal, tasks[i].start, options, task_seed + 1);
    }
  });
  return runs;
}

}  // namespace panonav
