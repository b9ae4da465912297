// Routes of 60 m repeated in closed loop, their size in a file, and localisation on a real route.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/rows.hpp"
#include "lab/y03/routes.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav/route/route_position.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/obstacle_sense.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

namespace {

constexpr double long_route_m = 60.0;
// Distance between lines for which the paper states its bytes [Y03 section 2.2].
constexpr double spacing_m = 0.1;
constexpr int runs_per_route = 10;  // per route, every second one backwards

// A route, its panorama and the runs that repeated it.
struct RepeatedRoute {
  std::vector<Pose2> poses;
  RoutePanorama panorama;
  std::vector<RouteRun> runs;
};

// Repeats a route with one sensor for obstacles; every second run is backwards.
std::vector<RouteRun> repeat_with_sensor(const RouteScene& place, const RouteTracker& tracker,
                                         int runs, simulation::ObstacleSensor sensor,
                                         std::uint64_t seed, Executor& executor) {
  return simulation::make_each(executor, static_cast<std::size_t>(runs), [&](std::size_t i) {
    return repeat_route(place, tracker, {.back = i % 2 == 1, .sensor = sensor},
                        Random(seed, 100 + i).next());
  });
}

RepeatedRoute record_and_repeat_route(const RouteScene& place, int runs, std::uint64_t seed,
                                      Executor& executor) {
  RepeatedRoute repeated;
  repeated.poses = plan_curved_route(place, long_route_m, spacing_m, seed);
  repeated.panorama = record_route(place, repeated.poses, Random(seed, 7).next(), executor);
  repeated.runs = repeat_with_sensor(place, RouteTracker(repeated.panorama), runs,
                                     simulation::ObstacleSensor::bumper, seed, executor);
  return repeated;
}

// Measurements of all runs along several routes.
struct RouteResults {
  std::vector<double> lateral_cm;
  std::vector<double> lateral_back_cm;
  std::vector<double> p95_cm;
  std::vector<double> fix_cm;
  std::size_t completed = 0;
  std::size_t lines = 0;
  std::size_t off_route = 0;
  std::size_t obstacle_steps = 0;

  void add(const RouteRun& run, bool is_back) {
    const double mean_cm = 100.0 * mean(run.lateral_m);
    lateral_cm.push_back(mean_cm);
    if (is_back) lateral_back_cm.push_back(mean_cm);
    p95_cm.push_back(100.0 * quantile(run.lateral_m, 0.95));
    if (!run.position_m.empty()) fix_cm.push_back(100.0 * median(run.position_m));
    completed += run.has_completed() ? 1 : 0;
    lines += run.truth.size();
    off_route += run.off_route;
    obstacle_steps += run.obstacle_steps;
  }
};

void report_routes(const ReproductionOptions& options, const std::string& name,
                   const RouteScene& first_place, const std::vector<RepeatedRoute>& routes,
                   Reproduction& result) {
  RouteResults results;
  for (const RepeatedRoute& route : routes) {
    for (std::size_t i = 0; i < route.runs.size(); ++i) results.add(route.runs[i], i % 2 == 1);
  }
  const std::size_t runs = results.lateral_cm.size();
  const std::string id = "y03.route." + name;
  const std::string what = name +
                           ", 60 m route repeated with wheels 5 % wrong, start 0.3 m off, by a "
                           "robot with a bumper";
  add_row(result, id + ".lateral", what + ": distance from the route",
          mean_figure(results.lateral_cm, options.seed), "cm", at_most(5.0))
      .over = "mean of " + std::to_string(runs) + " runs";
  add_rate(result, id + ".completed", what + ": runs that reach the end, none lost",
           results.completed, runs, at_least(1.0));
  if (!results.lateral_back_cm.empty()) {
    add_mean(result, id + ".lateral_back", what + ": distance from the route, runs back alone",
             "cm", results.lateral_back_cm);
  }
  add_mean(result, id + ".lateral_95", what + ": distance that 95 % of a run keep within", "cm",
           results.p95_cm);
  if (!results.fix_cm.empty()) {
    add_median(result, id + ".fix", what + ": error of a fix, median of a run", "cm",
               results.fix_cm);
  }
  add_rate(result, id + ".off_route", what + ": lines reported as off the route", results.off_route,
           results.lines);
  add_rate(result, id + ".turned_aside", what + ": steps at which something was in the way",
           results.obstacle_steps, results.lines);
  viewer::MapPlot map{.title = first_place.name, .layers = viewer::scene_layers(first_place.scene)};
  std::ranges::move(make_route_layers(routes.front().poses, routes.front().runs),
                    std::back_inserter(map.layers));
  add_plot(result, "route_" + name + ".svg",
           "A route of 60 m through " + name +
               ", recorded once and repeated forward and back; the driven paths lie on it.",
           map);
}

// Runs of the same routes by robots with another sensor for obstacles.
struct SensorRoutes {
  simulation::ObstacleSensor sensor;
  std::string id;
  std::string what;
  RouteResults results;
};

void report_sensors(const std::string& name, const std::vector<SensorRoutes>& sensors,
                    Reproduction& result) {
  for (const SensorRoutes& kind : sensors) {
    const std::string id = "y03.route." + name + "." + kind.id;
    const std::string what = name + ", the same 60 m routes with " + kind.what;
    add_mean(result, id + ".lateral", what + ": distance from the route", "cm",
             kind.results.lateral_cm);
    add_rate(result, id + ".completed", what + ": runs that reach the end", kind.results.completed,
             kind.results.lateral_cm.size());
  }
}

// Returns the size of a memory file on disk, including the write-ahead log.
std::uint64_t file_bytes(const std::filesystem::path& path) {
  std::uint64_t bytes = std::filesystem::file_size(path);
  const std::filesystem::path log = path.string() + "-wal";
  if (std::filesystem::exists(log)) bytes += std::filesystem::file_size(log);
  return bytes;
}

void measure_file(const std::vector<RepeatedRoute>& routes, Reproduction& result) {
  const std::filesystem::path path = result.out / "routes.panonav";
  std::filesystem::remove(path);
  MemoryHeader header;
  header.shape = {1, 1};
  std::uint64_t empty_bytes = 0;
  double length_m = 0.0;
  std::uint64_t packed_bytes = 0;
  {
    MemoryFile file = MemoryFile::create(path, header);
    // Add an unmeasured route first, because it creates the tables.
    RoutePanorama unmeasured_route(routes.front().panorama.columns());
    unmeasured_route.append({0.0, 0.0, 0.0}, routes.front().panorama.line(0));
    static_cast<void>(file.append_route("none", unmeasured_route));
  }
  empty_bytes = file_bytes(path);
  {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    for (std::size_t i = 0; i < routes.size(); ++i) {
      const std::string name = "route " + std::to_string(i);
      static_cast<void>(file.append_route(name, routes[i].panorama));
      require(file.route(name) == routes[i].panorama, "route read back", 0.0, "the one written");
      length_m += routes[i].panorama.length_m();
      packed_bytes += file.route_bytes(name);
    }
  }
  const std::uint64_t full_bytes = file_bytes(path);
  std::filesystem::remove(path);
  const double megabytes_per_km = 1e-3 / length_m;
  const std::string what = "memory of routes through loop, a line every 10 cm, ";
  add_row(result, "y03.memory.file", what + "by what a memory file grows, a kilometre",
          megabytes_per_km * static_cast<double>(full_bytes - empty_bytes), "MB", at_most(3.6),
          std::pair(3.6, 3.6));
  add_row(result, "y03.memory.packed", what + "packed lines and poses alone, a kilometre",
          megabytes_per_km * static_cast<double>(packed_bytes), "MB");
}

int count_routes(const ReproductionOptions& options) {
  return std::max(1, options.runs / runs_per_route);
}

}  // namespace

void RouteExperiments::reproduce_loop_routes() const {
  std::vector<RepeatedRoute> routes;
  std::optional<RouteScene> first;
  using enum simulation::ObstacleSensor;
  std::vector<SensorRoutes> sensors{
      {ranges, "ranges", "a bumper and eight noisy ranges", {}},
      {camera, "camera", "a bumper and the floor in the pictures", {}},
      {truth, "truth", "the true free space, which no robot knows", {}}};
  const int runs = std::min(runs_per_route, options.runs);
  for (int i = 0; i < count_routes(options); ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    RouteScene place =
        make_route_scene(simulation::make_scene("loop", {.seed = seed}), "loop", executor);
    simulation::add_floor_camera(place);
    routes.push_back(record_and_repeat_route(place, runs, seed, executor));
    const RouteTracker tracker(routes.back().panorama);
    for (SensorRoutes& kind : sensors) {
      for (const RouteRun& run :
           repeat_with_sensor(place, tracker, runs, kind.sensor, seed, executor)) {
        kind.results.add(run, false);
      }
    }
    if (!first) first = std::move(place);
  }
  report_routes(options, "loop", *first, routes, result);
  report_sensors("loop", sensors, result);
  measure_file(routes, result);
}

void RouteExperiments::reproduce_world_routes(const std::string& name) const {
  const RouteScene place =
      make_route_scene(simulation::read_gazebo_world(options.data, name), name, executor);
  std::vector<RepeatedRoute> routes;
  for (int i = 0; i < count_routes(options); ++i) {
    routes.push_back(record_and_repeat_route(place, std::min(runs_per_route, options.runs),
                                             options.seed + static_cast<std::uint64_t>(i),
                                             executor));
  }
  report_routes(options, name, place, routes, result);
}

void RouteExperiments::reproduce_real_route() const {
  const Dataset dataset = read_dataset(options.data / "sussex_route");
  const PanoramaReader reader(dataset.source, {});
  auto lines = simulation::make_each(executor, dataset.entries.size(), [&](std::size_t i) {
    return horizon_scanline(reader.read(dataset.entries[i].path));
  });
  std::vector<Point2> places;
  for (const DatasetEntry& entry : dataset.entries) {
    if (!entry.pose) throw FileError((options.data / "sussex_route").string(), "has no positions");
    places.push_back({entry.pose->x_m, entry.pose->y_m});
  }
  const std::vector<Pose2> poses = estimate_headings(places);
  constexpr std::size_t every = 10;
  RoutePanorama route;
  for (std::size_t i = 0; i < poses.size(); i += every) {
    static_cast<void>(route.append(poses[i], std::span<const float>(lines[i])));
  }
  const RouteTracker tracker(route);
  const auto found = simulation::make_each(executor, poses.size(), [&](std::size_t i) {
    return i % every != 0 ? tracker.search(lines[i]) : std::nullopt;
  });
  std::vector<double> along_error_cm;
  std::vector<double> lateral_error_cm;
  std::size_t queries = 0;
  viewer::MapLayer right{.label = "fixes", .colour = viewer::PlotColour::blue};
  viewer::MapLayer remembered{.label = "remembered lines", .colour = viewer::PlotColour::black};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i % every == 0) {
      remembered.circles.push_back(places[i]);
      continue;
    }
    ++queries;
    if (!found[i]) continue;
    const RoutePosition truth = project_onto_route(route.poses(), places[i]);
    along_error_cm.push_back(100.0 * std::abs(found[i]->along_m - truth.along_m));
    lateral_error_cm.push_back(100.0 * std::abs(found[i]->lateral_m - truth.lateral_m));
    right.dots.push_back(found[i]->pose.position());
  }
  const std::string what =
      "sussex_route, outdoors, every 10th line remembered, the others each searched alone";
  add_median(result, "y03.sussex.along", what + ": error along the route, median", "cm",
             along_error_cm, at_most(3.0));
  add_median(result, "y03.sussex.lateral", what + ": error beside the route, median", "cm",
             lateral_error_cm);
  add_rate(result, "y03.sussex.found", what + ": found on the route", along_error_cm.size(),
           queries);
  viewer::MapLayer driven{
      .label = "driven path", .colour = viewer::PlotColour::grey, .lines = {places}};
  add_plot(
      result, "sussex_route.svg",
      "A real route outdoors: where each picture between the remembered lines was found, without "
      "odometry.",
      viewer::MapPlot{.title = "sussex_route", .layers = {driven, right, remembered}});
}

}  // namespace panonav::lab
