#include "lab/runs/homing_run.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::lab {

HomingPlace make_homing_place(simulation::Scene scene, HomingCamera camera, Executor& executor) {
  camera.frame.camera_height_m = scene.camera_height_m;
  return {simulation::make_place(std::move(scene), executor), camera};
}

namespace {

Panorama capture_level_panorama(const HomingPlace& place, const Pose2& pose, std::uint64_t seed) {
  Executor here(1);
  const HomingCamera& camera = place.camera;
  const Panorama seen = simulation::capture_panorama(*place.renderer, pose, camera.rendering,
                                                     camera.frame, camera.sensor, seed, here);
  const Tilt measured = camera.levelled ? sample_tilt(camera.frame, seed) : Tilt{};
  return level_panorama(seen, measured);
}

}  // namespace

HomingView capture_homing_view(const HomingPlace& place, const Pose2& pose, std::uint64_t seed) {
  return homing_view(
      compute_signature(capture_level_panorama(place, pose, seed), place.camera.components));
}

HomingView capture_chain_view(const HomingPlace& place, const Pose2& pose, std::uint64_t seed) {
  return homing_view(compute_signature(preprocess(capture_level_panorama(place, pose, seed), {}),
                                       place.camera.components));
}

std::string_view to_string(HomingRunEnd end) {
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

bool HomingRun::is_success(double radius_m) const noexcept {
  return end == HomingRunEnd::arrived && end_distance_m <= radius_m;
}

HomingRun run_home(const HomingPlace& place, const HomingView& home, const Pose2& goal,
                   const Pose2& start, const HomingRunOptions& options, std::uint64_t seed) {
  HomingPursuit pursuit(home, options.pursuit, options.vector);
  simulation::SimulatedRobot robot(*place.free_space, options.motion, options.obstacles, start,
                                   seed, options.sensor, place.floor_camera.get());
  Random noise_of_views(seed, 2);
  HomingRun run;
  run.goal = goal;
  for (;;) {
    const HomingView view = capture_homing_view(place, robot.pose(), noise_of_views.next());
    const HomingPursuit::Decision decision = pursuit.decide(view);
    if (run.path.empty()) run.start_difference = decision.difference;
    run.path.push_back(robot.pose());
    run.vectors.push_back(decision.vector);
    const auto finish = [&](HomingRunEnd end) {
      run.end = end;
      run.end_distance_m = distance(robot.pose().position(), goal.position());
      run.end_difference = decision.difference;
      return run;
    };
    switch (decision.state) {
      case HomingPursuit::State::moving:
        break;
      case HomingPursuit::State::arrived:
        return finish(HomingRunEnd::arrived);
      case HomingPursuit::State::wrong_place:
        return finish(HomingRunEnd::wrong_place);
      case HomingPursuit::State::exhausted:
        return finish(HomingRunEnd::exhausted);
    }
    const auto step = robot.drive(decision.turn_rad, decision.advance_m);
    run.met_obstacle = run.met_obstacle || step.has_met_obstacle;
    if (step.is_stopped) {
      run.path.push_back(robot.pose());
      return finish(HomingRunEnd::blocked);
    }
  }
}

std::vector<HomingTask> sample_homing_tasks(const HomingPlace& place, int count, double radius_m,
                                            std::uint64_t seed) {
  require(count >= 1, "runs home", count, ">= 1");
  require(radius_m > 0.0, "radius of the starts", radius_m, "> 0");
  std::vector<HomingTask> tasks;
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    HomingTask task;
    task.goal = place.free_space->random_pose(random);
    do {
      const double offset_m = radius_m * std::sqrt(random.uniform());
      const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
      task.start = {task.goal.x_m + offset_m * std::cos(direction_rad),
                    task.goal.y_m + offset_m * std::sin(direction_rad),
                    wrap_angle(random.uniform(-std::numbers::pi, std::numbers::pi))};
    } while (!place.free_space->is_free(task.start.position()));
    tasks.push_back(task);
  }
  return tasks;
}

std::vector<HomingRun> run_home(const HomingPlace& place, const std::vector<HomingTask>& tasks,
                                const HomingRunOptions& options, std::uint64_t seed,
                                Executor& executor) {
  return simulation::make_each(executor, tasks.size(), [&](std::size_t i) {
    const std::uint64_t task_seed = Random(seed, i).next();
    const HomingView home = capture_homing_view(place, tasks[i].goal, task_seed);
    return run_home(place, home, tasks[i].goal, tasks[i].start, options, task_seed + 1);
  });
}

}  // namespace panonav::lab
