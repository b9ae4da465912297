// Homing runs in Gazebo worlds and built-in scenes.

#include "lab/s06/worlds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "lab/experiments.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

std::size_t count_successes(const std::vector<HomingRun>& runs) {
  return count_where(runs, [](const HomingRun& run) { return run.is_success(homing_success_m); });
}

viewer::MapPlot draw_failed_run(const HomingPlace& place, const HomingRun& run,
                                std::size_t number) {
  constexpr double margin_m = 0.6;
  Point2 low = run.goal.position();
  Point2 high = low;
  for (const Pose2& pose : run.path) {
    low = {std::min(low.x_m, pose.x_m), std::min(low.y_m, pose.y_m)};
    high = {std::max(high.x_m, pose.x_m), std::max(high.y_m, pose.y_m)};
  }
  viewer::MapPlot map{.title = "run " + std::to_string(number) + ": " + explain_failure(run),
                      .layers = viewer::scene_layers(place.scene)};
  map.shown = std::pair(Point2{low.x_m - margin_m, low.y_m - margin_m},
                        Point2{high.x_m + margin_m, high.y_m + margin_m});
  map.layers.push_back(
      {.label = "way", .colour = viewer::PlotColour::blue, .lines = {positions_of(run.path)}});
  map.layers.push_back({.label = "start",
                        .colour = viewer::PlotColour::green,
                        .circles = {run.path.front().position()}});
  map.layers.push_back({.label = "end",
                        .colour = viewer::PlotColour::vermilion,
                        .crosses = {run.path.back().position()}});
  map.layers.push_back(
      {.label = "goal", .colour = viewer::PlotColour::black, .squares = {run.goal.position()}});
  return map;
}

viewer::MapPlot draw_all_runs(const HomingPlace& place, const std::vector<HomingRun>& runs,
                              const std::string& name) {
  viewer::MapPlot map{.title = "Runs home in " + name, .layers = viewer::scene_layers(place.scene)};
  viewer::MapLayer reached{.label = "reached home", .colour = viewer::PlotColour::blue};
  viewer::MapLayer failed{.label = "did not", .colour = viewer::PlotColour::vermilion};
  viewer::MapLayer goals{.label = "goals", .colour = viewer::PlotColour::black};
  for (const HomingRun& run : runs) {
    (run.is_success(homing_success_m) ? reached : failed).lines.push_back(positions_of(run.path));
    goals.squares.push_back(run.goal.position());
  }
  map.layers.push_back(std::move(reached));
  map.layers.push_back(std::move(failed));
  map.layers.push_back(std::move(goals));
  return map;
}

// Adds the rate at which robots that ended elsewhere report that they are not at home.
void add_rate_of_noticed_failures(Reproduction& result, const std::string& id,
                                  const std::string& what, const std::vector<HomingRun>& runs) {
  std::size_t elsewhere = 0;
  std::size_t noticed = 0;
  for (const HomingRun& run : runs) {
    if (run.end_distance_m <= homing_success_m) continue;
    ++elsewhere;
    noticed += run.end != HomingRunEnd::arrived ? 1 : 0;
  }
  if (elsewhere == 0) return;
  add_rate(result, id,
           what + ": ends farther than 10 cm from home that the robot reports as not home", noticed,
           elsewhere);
}

struct EndDifferences {
  std::vector<double> at_home;
  std::vector<double> elsewhere;
  void add(const std::vector<HomingRun>& runs) {
    for (const HomingRun& run : runs) {
      (run.end_distance_m <= homing_success_m ? at_home : elsewhere).push_back(run.end_difference);
    }
  }
};

}  // namespace

std::string explain_failure(const HomingRun& run) {
  if (run.is_success(homing_success_m)) return "";
  const std::string where = std::to_string(std::lround(100.0 * run.end_distance_m)) + " cm off";
  switch (run.end) {
    case HomingRunEnd::blocked:
      return "an obstacle stopped it, " + where;
    case HomingRunEnd::exhausted:
      return (run.met_obstacle ? "found no way round an obstacle, " : "does not come to rest, ") +
             where;
    case HomingRunEnd::wrong_place:
      return (run.met_obstacle ? "led off by an obstacle into another minimum and says so, "
                               : "another local minimum and says so, ") +
             where;
    case HomingRunEnd::arrived:
      return (run.end_distance_m <= 3.0 * homing_success_m ? "stopped short, "
                                                           : "takes a wrong place for home, ") +
             where;
  }
  return where;
}

void reproduce_homing_in_world(const std::string& name, const Experiments& context) {
  const auto& [options, executor, reproduction] = context;
  const std::uint64_t seed = options.seed;
  const HomingPlace place =
      make_homing_place(simulation::read_gazebo_world(options.data, name),
                        {.rendering = context.make_rendering(40, 256)}, executor);
  const auto tasks = sample_homing_tasks(place, options.starts, homing_start_radius_m, seed);
  const auto runs = run_home(place, tasks, {}, seed, executor);

  const std::string id = "s06.world." + name;
  const std::string what = name + ", starts within 1.5 m";
  add_rate(reproduction, id + ".success", what + ": home within 10 cm", count_successes(runs),
           runs.size(), at_least(0.9));
  std::vector<HomingRun> in_sight;
  std::vector<double> steps;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (place.free_space->is_free_between(tasks[i].start.position(), tasks[i].goal.position())) {
      in_sight.push_back(runs[i]);
    }
    steps.push_back(static_cast<double>(runs[i].path.size() - 1));
  }
  if (!in_sight.empty()) {
    add_rate(reproduction, id + ".success_in_sight",
             what + ", the straight line free: home within 10 cm", count_successes(in_sight),
             in_sight.size());
  }
  add_rate_of_noticed_failures(reproduction, id + ".noticed", what, runs);
  add_median(reproduction, id + ".steps", what + ": steps of a run", "steps", steps);

  const auto add_other = [&](const std::string& key, const std::string& text,
                             const HomingRunOptions& changed) {
    add_rate(reproduction, id + key, what + ", " + text + ": home within 10 cm",
             count_successes(run_home(place, tasks, changed, seed, executor)), runs.size());
  };
  HomingRunOptions published;
  published.vector = published_homing_options(5);
  published.pursuit.strategy = HomingPursuitOptions::Strategy::steady;
  add_other(".published", "the published rule with K = 5", published);
  published.pursuit.strategy = HomingPursuitOptions::Strategy::coarse_to_fine;
  add_other(".published_coarse_to_fine", "the published rule with K = 2, 4, 10", published);
  HomingRunOptions holonomic;
  holonomic.motion.drive = DriveKind::holonomic;
  add_other(".holonomic", "a holonomic robot", holonomic);
  HomingRunOptions stopping;
  stopping.obstacles = simulation::ObstacleRule::stop;
  add_other(".stopped_by_obstacles", "the first obstacle ends a run", stopping);

  const std::string prefix = "s06_world_" + name;
  add_plot(reproduction, prefix + ".svg",
           "Homing runs in " + name + " from starts within 1.5 m of random goals",
           draw_all_runs(place, runs, name));
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].is_success(homing_success_m)) continue;
    const viewer::MapPlot map = draw_failed_run(place, runs[i], i);
    const std::string file = prefix + "_failure_" + std::to_string(i) + ".svg";
    add_plot(reproduction, file, name + ", " + map.title, map);
  }
}

void reproduce_homing_in_scenes(int starts, const Experiments& context) {
  const auto& [options, executor, reproduction] = context;
  const std::uint64_t seed = options.seed;
  constexpr std::array<const char*, 5> scenes{"office", "lab", "hall", "loop", "garden"};
  constexpr double tilt_rad = 3.0 * std::numbers::pi / 180.0;
  const std::uint64_t seeds_per_scene = starts > 1 ? 2 : 1;
  EndDifferences ends;
  for (const char* const name : scenes) {
    std::vector<HomingRun> flat;
    std::vector<HomingRun> tilted;
    std::vector<HomingRun> holonomic_runs;
    for (std::uint64_t variant = 0; variant < seeds_per_scene; ++variant) {
      const std::uint64_t number = seed + variant;
      HomingPlace place =
          make_homing_place(simulation::make_scene(name, {.seed = number}),
                            {.rendering = context.make_rendering(40, 256)}, executor);
      const auto tasks = sample_homing_tasks(place, starts, homing_start_radius_m, number);
      const auto append = [&](std::vector<HomingRun>& all, const HomingRunOptions& changed) {
        for (HomingRun& run : run_home(place, tasks, changed, number, executor)) {
          all.push_back(std::move(run));
        }
      };
      append(flat, {});
      HomingRunOptions holonomic;
      holonomic.motion.drive = DriveKind::holonomic;
      append(holonomic_runs, holonomic);
      place.camera.frame.tilt_rad = tilt_rad;
      append(tilted, {});
    }
    const std::string id = std::string("s06.scene.") + name;
    const std::string what = std::string(name) + ", starts within 1.5 m";
    add_rate(reproduction, id + ".success", what + ": home within 10 cm", count_successes(flat),
             flat.size());
    add_rate(reproduction, id + ".holonomic", what + ", a holonomic robot: home within 10 cm",
             count_successes(holonomic_runs), holonomic_runs.size());
    add_rate(reproduction, id + ".tilt",
             what + ", tilted by 3 degrees in a random direction at each view: home within 10 cm",
             count_successes(tilted), tilted.size());
    std::vector<double> distances_m;
    for (const HomingRun& run : tilted) distances_m.push_back(run.end_distance_m);
    add_median(reproduction, id + ".tilt_error", what + ", tilted: distance from home at the end",
               "m", distances_m);
    ends.add(flat);
  }
  if (!ends.at_home.empty()) {
    add_row(reproduction, "s06.difference.at_home",
            "difference of the views where a run ends within 10 cm of home: 99 % quantile of " +
                std::to_string(ends.at_home.size()),
            quantile(ends.at_home, 0.99), "");
  }
  if (!ends.elsewhere.empty()) {
    add_row(reproduction, "s06.difference.elsewhere",
            "the same farther from home: 1 % quantile of " + std::to_string(ends.elsewhere.size()),
            quantile(ends.elsewhere, 0.01), "");
  }
}

}  // namespace panonav::lab
