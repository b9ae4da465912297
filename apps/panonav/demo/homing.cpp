#include "demo/homing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/runs/surroundings.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/positions.hpp"
#include "panonav/io/image_file.hpp"
#include "reporting/plot.hpp"
#include "reports/home_picture.hpp"

namespace panonav::command {

namespace {

constexpr double close_m = 0.1;

/// Places like the one that a user would come back to: a start one metre off in the open, so that
/// no wall stands in between.
std::vector<HomingTask> tasks_in(const HomingPlace& place, int count, std::uint64_t seed) {
  constexpr double away_m = 1.0;
  std::vector<HomingTask> tasks;
  Random random(seed, 1);
  while (tasks.size() < static_cast<std::size_t>(count)) {
    const Pose2 goal = place.free_space->random_pose(random);
    const double way_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Pose2 start{goal.x_m + away_m * std::cos(way_rad), goal.y_m + away_m * std::sin(way_rad),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    if (place.free_space->is_free_between(goal.position(), start.position())) {
      tasks.push_back({goal, start});
    }
  }
  return tasks;
}

void draw_runs(const Scene& office, const std::vector<HomingRun>& runs,
               const std::filesystem::path& path) {
  MapLayer homes{.label = "home", .colour = PlotColour::black};
  MapLayer starts{.label = "start", .colour = PlotColour::green};
  MapLayer good{.label = "way home", .colour = PlotColour::blue};
  MapLayer bad{.label = "ended elsewhere", .colour = PlotColour::vermilion};
  for (const HomingRun& run : runs) {
    homes.squares.push_back(run.goal.position());
    starts.circles.push_back(run.path.front().position());
    std::vector<Point2> line = positions_of(run.path);
    if (line.size() > 1) (run.succeeds(close_m) ? good : bad).lines.push_back(std::move(line));
  }
  MapPlot map{.title = "Runs home in the office", .layers = scene_layers(office)};
  for (const MapLayer& layer : {good, bad, starts, homes}) map.layers.push_back(layer);
  write_plot(path, map);
}

}  // namespace

DemoHoming show_homing(const Scene& office, int runs, std::uint64_t seed,
                       const std::filesystem::path& out, Session& session, ReportPage& page) {
  const HomingPlace place = make_homing_place(office, {}, session.executor());
  const auto tasks = tasks_in(place, runs, seed);
  DemoHoming homing;
  homing.runs = run_home(place, tasks, {}, seed, session.executor());
  std::size_t steps = 0;
  for (const HomingRun& run : homing.runs) {
    homing.arrived += run.succeeds(close_m) ? 1 : 0;
    homing.distances_m.push_back(run.end_distance_m);
    steps += run.path.size() - 1;
  }
  draw_runs(office, homing.runs, out / "homing.svg");
  const auto seen_from = [&](const Pose2& pose) {
    const HomingCamera& camera = place.camera;
    return take_panorama(*place.renderer, pose, camera.rendering, camera.frame, camera.sensor, seed,
                         session.executor());
  };
  const HomingRun& shown = homing.runs.front();
  const Image picture =
      picture_of_homing(seen_from(shown.goal), seen_from(shown.path.front()), shown.vectors.front(),
                        shown.vectors.front().length() > 0.0);
  write_png(out / "way_home.png", picture.view());

  page.part("Back home", {std::to_string(homing.arrived) + " of " + std::to_string(runs),
                          "robots found home from a metre away, by one remembered picture"});
  page.text(
      "From one view of a place the robot finds its way back to it, without a map and without "
      "knowing which way it faces: the Fourier components of both views tell the direction home. "
      "It was put down one metre away from " +
      std::to_string(runs) +
      " places, with random heading, and made step after step, each after a new picture. Its "
      "wheels and "
      "its camera are noisy.");
  page.figures({{std::to_string(homing.arrived) + " of " + std::to_string(runs),
                 "runs that ended within 10 cm of home, and knew it"},
                {fixed(100.0 * median(homing.distances_m), 1) + " cm",
                 "median distance from home at the end"},
                {fixed(static_cast<double>(steps) / runs, 0), "steps a run, on average"}});
  page.pictures(
      {{"way_home.png",
        "The first run. Above, the view at home, turned as the robot faces at the start; below, "
        "what it sees there. Orange: the direction home, where things spread out on the way; "
        "blue: the opposite one; grey: straight ahead."},
       {"homing.svg",
        "All runs, from the green circles to the black squares. A run that ended elsewhere is "
        "orange."}});
  return homing;
}

}  // namespace panonav::command
