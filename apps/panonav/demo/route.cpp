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

constexpr double seconds_a_look = 0.3;

viewer::PicturePlot draw_route_image(const RoutePanorama& route) {
  const auto columns = static_cast<std::size_t>(route.columns());
  viewer::PicturePlot plot{.title = "What the robot remembers of the route",
                           .x_label = "azimuth from straight ahead [degrees], left positive",
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

/// The first run, line by line.
viewer::RunPage replay_run(const lab::RouteScene& place, const RoutePanorama& panorama,
                           const lab::RouteRun& run, std::uint64_t seed, Executor& executor) {
  viewer::RunPage page("A route is repeated", run.truth.size());
  std::vector<viewer::RouteMark> marks;
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    const Pose2& truth = run.truth[i];
    const auto& seen = run.sightings[i];
    recordings::RunMoment moment{.stamp_s = seconds_a_look * static_cast<double>(i)};
    moment.truth = ReferencePose{truth.x_m, truth.y_m, truth.heading_rad};
    moment.sure = seen.has_value();
    moment.state = seen ? "on the route" : "off the route";
    moment.values.emplace_back("lateral offset", format_fixed(100.0 * run.lateral_m[i], 1) + " cm");
    if (seen) moment.pose = seen->pose;
    moment.panorama = simulation::take_panorama(
        *place.renderer, truth, {.rows = 40, .columns = 256, .rays_per_axis = 1},
        {.camera_height_m = place.scene.camera_height_m}, place.camera.sensor, seed, executor);
    if (i == 0) {
      moment.walls = viewer::scene_outlines(place.scene);
      moment.plan.assign(panorama.poses().begin(), panorama.poses().end());
    }
    page.add(moment);
    marks.push_back({.along_m = seen ? std::optional(seen->along_m) : std::nullopt});
  }
  page.route(draw_route_image(panorama), marks);
  return page;
}

/// Repeats the route there and back, and measures both drives.
DemoRoute repeat_and_measure(const lab::RouteScene& place, const RoutePanorama& panorama,
                             std::uint64_t seed, Executor& executor) {
  const RouteTracker tracker(panorama);
  DemoRoute route;
  route.length_m = panorama.length_m();
  route.bytes = panorama.size() * static_cast<std::size_t>(panorama.columns());
  route.runs.resize(2);
  executor.for_chunks(route.runs.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
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
  // The value of automatic exposure in these rooms.
  place.camera.sensor.exposure = 2.0;
  const auto way = lab::plan_curved_route(place, length_m, spacing_m, seed);
  const RoutePanorama panorama = lab::record_route(place, way, seed, executor);
  DemoRoute route = repeat_and_measure(place, panorama, seed, executor);
  viewer::MapPlot map{.title = "The route, and both drives",
                      .layers = viewer::scene_layers(office)};
  std::ranges::move(lab::make_route_layers(way, route.runs), std::back_inserter(map.layers));

  const auto median_cm = [](const std::vector<double>& values) {
    return values.empty() ? std::string("none") : format_fixed(100.0 * median(values), 1) + " cm";
  };
  page.begin_part("Routes",
                  {median_cm(route.lateral_m),
                   "is the median distance of a robot from a route that it was shown once"});
  page.add_text(
      "Of a route the robot stores one line of pixels every 10 cm: its horizon, a byte a degree. "
      "Light in the plane of the camera travels straight from place to place, so these lines also "
      "predict what is seen to the sides of the route. The robot was shown a route of " +
      format_fixed(route.length_m, 0) +
      " m once, then put down 0.3 m away from its start as if it stood on it, with an odometry "
      "that is wrong by 5 %; it drove the route to its end, and another robot drove it back.");
  page.add_figures({{std::to_string(route.completed) + " of " + std::to_string(route.runs.size()),
                     "runs that reached the end of the route and reported so"},
                    {median_cm(route.lateral_m), "median distance from the route, from 1 m on"},
                    {median_cm(route.position_m), "median error of the position"},
                    {format_fixed(1e-3 * static_cast<double>(route.bytes), 0) + " kB",
                     "is the size of the route before compression"}});
  page.add_text(
      "Below is the first run. The striped image is all that the robot stores of the route: each "
      "row shows what it saw at one place, all around, straight ahead in the middle; the start is "
      "the lowest row, the end the highest. An object that the robot passes is a curve from the "
      "middle to one side. The mark shows the row at which the robot localises itself.");
  page.add_run(replay_run(place, panorama, route.runs.front(), seed, executor));
  page.add_plots(
      {{map,
        "The recorded route in black, below both drives: one forward, one back. Each robot "
        "was put down at a circle, 0.3 m to the side of the route, and returns to it; where "
        "only one colour is visible the drives coincide with the route."}});
  return route;
}

}  // namespace panonav::command
