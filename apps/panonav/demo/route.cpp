#include "demo/route.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

namespace {

constexpr double seconds_per_image = 0.3;

viewer::PicturePlot draw_route_image(const RoutePanorama& route) {
  const auto columns = static_cast<std::size_t>(route.columns());
  viewer::PicturePlot plot{.title = "Stored route: each row shows the horizon at one place",
                           .x_label = "azimuth [degrees]: 0 is straight ahead, positive is left",
                           .y_label = "distance along the route [m]",
                           .x_range = {180.0, -180.0},
                           .y_range = {0.0, route.length_m()},
                           .columns = route.columns(),
                           .rows = static_cast<int>(route.size()),
                           .x_tick = 45.0};
  for (std::size_t row = 0; row < route.size(); ++row) {
    const auto line = route.line(row);
    for (std::size_t i = 0; i < columns; ++i) {
      const std::size_t c = (2 * columns + columns / 2 - i) % columns;
      plot.values.push_back(static_cast<float>(line[c]) / 255.0F);
    }
  }
  return plot;
}

/// Returns the page that replays a run, line by line.
viewer::RunPage replay_run(const lab::RouteScene& place, const RoutePanorama& panorama,
                           const lab::RouteRun& run, std::uint64_t seed, Executor& executor) {
  viewer::RunPage page("Repeated route", run.truth.size());
  std::vector<viewer::RouteMark> marks;
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    const Pose2& truth = run.truth[i];
    const auto& fix = run.line_fixes[i];
    recordings::RunMoment moment{.stamp_s = seconds_per_image * static_cast<double>(i)};
    moment.truth = ReferencePose{truth.x_m, truth.y_m, truth.heading_rad};
    moment.sure = fix.has_value();
    moment.state = fix ? "on the route" : "off the route";
    moment.values.emplace_back("lateral offset", format_fixed(100.0 * run.lateral_m[i], 1) + " cm");
    if (fix) moment.pose = fix->pose;
    moment.panorama = simulation::capture_panorama(
        *place.renderer, truth, {.rows = 40, .columns = 256, .rays_per_axis = 1},
        {.camera_height_m = place.scene.camera_height_m}, place.camera.sensor, seed, executor);
    if (i == 0) {
      moment.walls = viewer::scene_outlines(place.scene);
      moment.plan.assign(panorama.poses().begin(), panorama.poses().end());
    }
    page.add(moment);
    marks.push_back({.along_m = fix ? std::optional(fix->along_m) : std::nullopt});
  }
  page.set_route(draw_route_image(panorama), marks);
  return page;
}

/// Repeats the route once forward and once back, and measures both drives.
DemoRoute repeat_and_measure(const lab::RouteScene& place, const RoutePanorama& panorama,
                             std::uint64_t seed, Executor& executor) {
  const RouteTracker tracker(panorama);
  DemoRoute route;
  route.length_m = panorama.length_m();
  route.bytes = panorama.size() * static_cast<std::size_t>(panorama.columns());
  route.runs.resize(2);
  executor.for_each_chunk(
      route.runs.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          route.runs[i] = lab::repeat_route(place, tracker, {.back = i == 1}, seed + i);
        }
      });
  for (const lab::RouteRun& run : route.runs) {
    route.completed += run.has_completed() ? 1 : 0;
    double travelled_m = 0.0;
    for (std::size_t i = 0; i < run.truth.size(); ++i) {
      if (i > 0) travelled_m += distance(run.truth[i - 1].position(), run.truth[i].position());
      if (travelled_m >= 1.0) route.lateral_m.push_back(run.lateral_m[i]);
    }
    route.position_m.insert(route.position_m.end(), run.position_m.begin(), run.position_m.end());
  }
  return route;
}

}  // namespace

DemoRoute demonstrate_route(const simulation::Scene& office, double length_m, std::uint64_t seed,
                            Session& session, viewer::ReportPage& page) {
  constexpr double spacing_m = 0.1;
  Executor& executor = session.executor();
  lab::RouteScene place = lab::make_route_scene(office, "office", executor);
  // Value that automatic exposure chooses in these rooms.
  place.camera.sensor.exposure = 2.0;
  const auto path = lab::plan_curved_route(place, length_m, spacing_m, seed);
  const RoutePanorama panorama = lab::record_route(place, path, seed, executor);
  DemoRoute route = repeat_and_measure(place, panorama, seed, executor);
  viewer::MapPlot map{.title = "The route and both drives", .layers = viewer::scene_layers(office)};
  std::ranges::move(lab::make_route_layers(path, route.runs), std::back_inserter(map.layers));

  const auto median_cm = [](const std::vector<double>& values) {
    return values.empty() ? std::string("none") : format_fixed(100.0 * median(values), 1) + " cm";
  };
  page.begin_part("Routes",
                  {median_cm(route.lateral_m),
                   "median distance of the robot from a route that it had driven once before"});
  page.add_text(
      "The robot stores one line of pixels for every 10 cm of a route. Each line shows the horizon "
      "around the robot, with one byte per degree. From these lines, the robot can also predict "
      "how the horizon looks from positions beside the route. In this test, the robot was driven "
      "once along a route of " +
      format_fixed(route.length_m, 0) +
      " m. Then it was placed 0.3 m beside the start of the route, and it did not know this "
      "offset. From there it drove the route again by itself. A second robot drove the route in "
      "the opposite direction. The odometry of both robots has an error of 5 %.");
  page.add_figures(
      {{std::to_string(route.completed) + " of " + std::to_string(route.runs.size()),
        "robots reached the end of the route and reported it"},
       {median_cm(route.lateral_m), "median distance from the route after the first metre"},
       {median_cm(route.position_m), "median error of the position that the robot computed"},
       {format_fixed(1e-3 * static_cast<double>(route.bytes), 0) + " kB",
        "size of the stored route before compression"}});
  page.add_text(
      "The animation below shows the drive of the first robot. The striped image is the stored "
      "route. Each row of it shows the horizon at one place. The lowest row is the start of the "
      "route, and the highest row is the end. The forward direction is in the middle of each row. "
      "An object that the robot passes appears as a curve from the middle to one side. The mark "
      "shows which row belongs to the position that the robot computed.");
  page.add_run(replay_run(place, panorama, route.runs.front(), seed, executor));
  page.add_plots(
      {{map,
        "Black: the stored route. Blue: the drive forward. Green: the drive in the opposite "
        "direction. Each robot started 0.3 m beside the route, at an orange circle, and then moved "
        "onto the route. Where only one line is visible, the drives coincide with the route."}});
  return route;
}

}  // namespace panonav::command
