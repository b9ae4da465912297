#include "demo/homing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::command {

namespace {

constexpr double max_arrival_distance_m = 0.1;

/// Samples random homes, each with a start at a distance of one metre and without obstacles in
/// between.
std::vector<lab::HomingTask> sample_tasks(const lab::HomingPlace& place, int count,
                                          std::uint64_t seed) {
  constexpr double start_distance_m = 1.0;
  std::vector<lab::HomingTask> tasks;
  Random random(seed, 1);
  while (tasks.size() < static_cast<std::size_t>(count)) {
    const Pose2 goal = place.free_space->random_pose(random);
    const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Pose2 start{goal.x_m + start_distance_m * std::cos(direction_rad),
                      goal.y_m + start_distance_m * std::sin(direction_rad),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    if (place.free_space->is_free_between(goal.position(), start.position())) {
      tasks.push_back({goal, start});
    }
  }
  return tasks;
}

/// Draws all runs at once, one frame per step.
viewer::MapAnimation draw_runs(const simulation::Scene& office,
                               const std::vector<lab::HomingRun>& runs) {
  viewer::MapLayer homes{.label = "home", .colour = viewer::PlotColour::black};
  viewer::MapLayer starts{.label = "start", .colour = viewer::PlotColour::green};
  std::size_t longest = 0;
  for (const lab::HomingRun& run : runs) {
    homes.squares.push_back(run.goal.position());
    starts.circles.push_back(run.path.front().position());
    longest = std::max(longest, run.path.size());
  }
  viewer::MapAnimation map{.title = "Drives home in the office",
                           .backdrop = viewer::scene_layers(office)};
  map.backdrop.push_back(homes);
  map.backdrop.push_back(starts);
  for (std::size_t step = 0; step < longest; ++step) {
    viewer::MapLayer good{.label = "path home", .colour = viewer::PlotColour::blue};
    viewer::MapLayer bad{.label = "ended elsewhere", .colour = viewer::PlotColour::vermilion};
    for (const lab::HomingRun& run : runs) {
      std::vector<Point2> line = positions_of(run.path);
      const bool has_ended = line.size() <= step + 1;
      line.resize(std::min(line.size(), step + 1));
      viewer::MapLayer& layer = has_ended && !run.is_success(max_arrival_distance_m) ? bad : good;
      layer.dots.push_back(line.back());
      if (line.size() > 1) layer.lines.push_back(std::move(line));
    }
    map.frames.push_back({.title = "step " + std::to_string(step), .layers = {good, bad}});
  }
  return map;
}

/// Shows the view at home, rotated to the robot's heading, above the robot's view.
std::vector<viewer::ReportView> make_report_views(const Panorama& home, const Panorama& current,
                                                  const HomeVector& vector) {
  std::vector<viewer::ViewMark> marks{{.azimuth_rad = 0.0, .colour = viewer::PlotColour::grey}};
  if (vector.length() > 0.0) {
    marks.push_back({vector.direction_rad(), viewer::PlotColour::vermilion, true});
    marks.push_back(
        {wrap_angle(vector.direction_rad() + std::numbers::pi), viewer::PlotColour::blue, true});
  }
  const double columns = -vector.heading_rad / (2.0 * std::numbers::pi) * home.columns();
  return {{rotate_columns(home, static_cast<int>(std::lround(columns))), marks,
           "First run: the stored view of home, rotated to the heading that the robot had at the "
           "start."},
          {current, marks,
           "First run: the robot's image at the start. Orange: the direction home; objects in this "
           "direction become larger during the drive. Blue: the opposite direction. Grey: the "
           "robot's forward direction."}};
}

}  // namespace

DemoHoming demonstrate_homing(const simulation::Scene& office, int runs, std::uint64_t seed,
                              Session& session, viewer::ReportPage& page) {
  const lab::HomingPlace place = lab::make_homing_place(office, {}, session.executor());
  const auto tasks = sample_tasks(place, runs, seed);
  DemoHoming homing;
  homing.runs = lab::run_home(place, tasks, {}, seed, session.executor());
  std::size_t steps = 0;
  for (const lab::HomingRun& run : homing.runs) {
    homing.arrived += run.is_success(max_arrival_distance_m) ? 1 : 0;
    homing.distances_m.push_back(run.end_distance_m);
    steps += run.path.size() - 1;
  }
  const auto take_view_at = [&](const Pose2& pose) {
    const lab::HomingCamera& camera = place.camera;
    return simulation::capture_panorama(*place.renderer, pose, camera.rendering, camera.frame,
                                        camera.sensor, seed, session.executor());
  };
  const lab::HomingRun& shown = homing.runs.front();

  page.begin_part(
      "Homing",
      {std::to_string(homing.arrived) + " of " + std::to_string(runs),
       "runs reached home; each run started one metre away and used one stored view of home"});
  page.add_text(
      "The robot has one stored view of one place: its home. It compares the Fourier components of "
      "this view with those of its current image. From the difference, it computes the direction "
      "home. It needs no map and does not know its heading. This test has " +
      std::to_string(runs) +
      " runs, each with a different home. Each run started one metre from home, with a random "
      "heading. The robot took an image, drove one step, and repeated this until it was home. Its "
      "odometry and its images contain noise.");
  page.add_figures(
      {{std::to_string(homing.arrived) + " of " + std::to_string(runs),
        "runs ended within 10 cm of home, and the robot reported its arrival"},
       {format_fixed(100.0 * median(homing.distances_m), 1) + " cm",
        "median distance from home at the end"},
       {format_fixed(static_cast<double>(steps) / runs, 0), "steps per run on average"}});
  page.add_plots({{draw_runs(office, homing.runs),
                   "All runs at once, step by step. Each run starts at a green circle; its home is "
                   "a black square. The path of a run that ends at another place turns orange."}});
  page.add_views(make_report_views(take_view_at(shown.goal), take_view_at(shown.path.front()),
                                   shown.vectors.front()));
  return homing;
}

}  // namespace panonav::command
