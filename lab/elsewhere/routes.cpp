// Routes learnt once and driven again by this library's memories and by rivals on the same
// pictures.

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/baselines/route_rivals.hpp"
#include "lab/experiments.hpp"
#include "lab/rows.hpp"
#include "lab/s06/chains.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/path.hpp"
#include "panonav_simulation/changing_scene.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_robot.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

// Result of one run along a learnt route.
struct MethodRun {
  bool has_reached = false;  // the end; methods that report arrivals have reported it there
  bool is_wrong = false;     // an arrival was reported elsewhere
  std::vector<double> offset_m;
  double length_m = 0.0;  // length of the route
  double bytes_per_100_m = 0.0;
  double picture_ms = 0.0;
};

namespace {

constexpr double recorded_spacing_m = 0.1;
constexpr double end_radius_m = 0.5;

using MakeMethod = std::unique_ptr<RouteMethod> (*)();
constexpr std::array<MakeMethod, 8> methods{
    make_snapshot_chain,  make_route_panorama, make_horizon_chain,     make_perfect_memory,
    make_infomax_network, make_mushroom_body,  make_sequence_matching, make_min_warping};

// A place, and the camera in it.
struct RoutePlace : simulation::SimulatedPlace {
  simulation::FrameOptions frame;
};

RoutePlace make_route_place(simulation::Scene scene, Executor& executor) {
  const double height_m = scene.camera_height_m;
  return {simulation::make_place(std::move(scene), executor), {.camera_height_m = height_m}};
}

RoutePicture take_picture(const RoutePlace& place, const Pose2& pose, const Pose2& moved,
                          std::uint64_t seed) {
  Executor here(1);
  const simulation::PanoramaRendering rendering{.rows = 20, .columns = 144, .rays_per_axis = 1};
  return {
      simulation::capture_panorama(*place.renderer, pose, rendering, place.frame, {}, seed, here),
      moved};
}

// Draws the next corner of a route: a position in sight 4 to 25 m ahead, if possible away from the
// route so far, else with more and more of these wishes dropped.
std::optional<Point2> draw_corner(const simulation::FreeSpace& space,
                                  const std::vector<Pose2>& corners, double heading_rad,
                                  bool may_turn_back, Random& random) {
  constexpr int draws = 1500;
  constexpr double apart_m = 3.0;
  const Point2 here = corners.back().position();
  for (const double max_turn_rad : {radians(60.0), radians(100.0), std::numbers::pi}) {
    if (max_turn_rad > 2.0 && !may_turn_back) break;
    for (int i = 0; i < draws; ++i) {
      const Point2 there = space.random_pose(random).position();
      const double leg_m = distance(here, there);
      const double turn_rad =
          corners.size() < 2
              ? 0.0
              : angle_difference(std::atan2(there.y_m - here.y_m, there.x_m - here.x_m),
                                 heading_rad);
      if (leg_m < 4.0 || leg_m > 25.0 || std::abs(turn_rad) > max_turn_rad) continue;
      const bool is_apart = std::ranges::none_of(corners, [&](const Pose2& corner) {
        return distance(corner.position(), there) < apart_m;
      });
      if ((is_apart || may_turn_back) && space.is_free_between(here, there)) return there;
    }
  }
  return std::nullopt;
}

// Rounds the corners of a path by two moving means, as far as it stays free.
std::vector<Pose2> round_corners(const simulation::FreeSpace& space, std::vector<Pose2> poses) {
  for (const std::size_t reach : {8U, 4U}) {
    std::vector<Pose2> round = poses;
    for (int pass = 0; pass < 2; ++pass) {
      const std::vector<Pose2> before = round;
      for (std::size_t i = 0; i < round.size(); ++i) {
        const std::size_t half = std::min({reach, i, round.size() - 1 - i});
        Point2 sum;
        for (std::size_t k = i - half; k <= i + half; ++k) {
          sum = {sum.x_m + before[k].x_m, sum.y_m + before[k].y_m};
        }
        const auto count = static_cast<double>(2 * half + 1);
        round[i] = {sum.x_m / count, sum.y_m / count, 0.0};
      }
    }
    if (std::ranges::all_of(round, [&](const Pose2& p) { return space.is_free(p.position()); })) {
      return simulation::resample(round, recorded_spacing_m);
    }
  }
  return poses;
}

// Plans a winding route with a pose every 0.1 m. Routes that need not turn back are preferred.
std::vector<Pose2> plan_winding_route(const simulation::FreeSpace& space, double length_m,
                                      std::uint64_t seed) {
  constexpr std::uint64_t attempts = 20;
  for (std::uint64_t attempt = 0;; ++attempt) {
    Random random(seed, attempt);
    std::vector<Pose2> corners{space.random_pose(random)};
    double heading_rad = 0.0;
    double path_m = 0.0;
    while (path_m < length_m) {
      const auto next = draw_corner(space, corners, heading_rad, attempt + 1 >= attempts, random);
      if (!next) break;
      const Point2 here = corners.back().position();
      heading_rad = std::atan2(next->y_m - here.y_m, next->x_m - here.x_m);
      path_m += distance(here, *next);
      corners.push_back({next->x_m, next->y_m, 0.0});
    }
    if (path_m < length_m && attempt < 2 * attempts) continue;
    std::vector<Pose2> route =
        round_corners(space, simulation::resample(corners, recorded_spacing_m));
    const auto poses = static_cast<std::size_t>(length_m / recorded_spacing_m) + 1;
    if (route.size() > poses) route.resize(poses);
    simulation::face_path(route);
    return route;
  }
}

std::vector<RoutePicture> record_pictures(const RoutePlace& place, const std::vector<Pose2>& route,
                                          std::uint64_t seed, Executor& executor) {
  Random errors(seed, 3);
  const DriftingOdometry odometry(route_odometry, errors);
  return simulation::make_each(executor, route.size(), [&](std::size_t i) {
    return take_picture(place, route[i],
                        i == 0 ? Pose2{} : odometry.measure(route[i - 1], route[i]),
                        Random(seed, 1000 + i).next());
  });
}

MethodRun follow_route(const RoutePlace& place, RouteMethod& method,
                       const std::vector<Pose2>& route, std::uint64_t seed) {
  Random errors(seed, 5);
  const DriftingOdometry odometry(route_odometry, errors);
  Pose2 start = route.front();
  start.heading_rad = wrap_angle(start.heading_rad + errors.normal(0.0, radians(5.0)));
  simulation::SimulatedRobot robot(*place.free_space, {}, simulation::ObstacleRule::pass, start,
                                   seed);
  const double length_m = path_length_m(route);
  // A robot this far from the route is lost; one that drove this far has missed the end.
  constexpr double max_offset_m = 5.0;
  const double max_travel_m = 20.0 + 1.5 * length_m;
  const int max_steps = 200 + static_cast<int>(8.0 * length_m);
  MethodRun run{.length_m = length_m};
  run.bytes_per_100_m = 100.0 * method.bytes() / length_m;
  Pose2 moved;
  double travelled_m = 0.0;
  double time_s = 0.0;
  int step = 0;
  for (; step < max_steps && travelled_m < max_travel_m; ++step) {
    const double offset_m = simulation::distance_from_route_m(robot.pose().position(), route);
    if (offset_m > max_offset_m) break;
    run.offset_m.push_back(offset_m);
    const bool is_at_end =
        distance(robot.pose().position(), route.back().position()) <= end_radius_m;
    if (!method.reports_arrival() && is_at_end && travelled_m > 0.5 * length_m) {
      run.has_reached = true;
      break;
    }
    const RoutePicture picture =
        take_picture(place, robot.pose(), moved,
                     Random(seed, 100'000 + static_cast<std::uint64_t>(step)).next());
    const double before_s = simulation::get_thread_cpu_time_s();
    const RouteDirection direction = method.steer(picture);
    time_s += simulation::get_thread_cpu_time_s() - before_s;
    if (direction.has_arrived) {
      run.has_reached = is_at_end;
      run.is_wrong = !is_at_end;
    }
    if (direction.has_arrived || direction.is_lost) break;
    const Pose2 before = robot.pose();
    if (robot.drive(direction.turn_rad, direction.advance_m).is_stopped) break;
    moved = odometry.measure(before, robot.pose());
    travelled_m += distance(before.position(), robot.pose().position());
  }
  run.picture_ms = 1e3 * time_s / std::max(1, step);
  return run;
}

// Learns a route in one place and drives it in others by all methods: runs[place][method].
std::vector<std::vector<MethodRun>> compare_methods(const RoutePlace& learnt_in,
                                                    const std::vector<RoutePlace>& driven_in,
                                                    const std::vector<Pose2>& route,
                                                    std::uint64_t seed, Executor& executor) {
  const auto pictures = record_pictures(learnt_in, route, seed, executor);
  const auto by_method = simulation::make_each(executor, methods.size(), [&](std::size_t m) {
    std::vector<MethodRun> runs;
    for (const RoutePlace& place : driven_in) {
      const auto method = methods[m]();
      method->learn(pictures);
      runs.push_back(follow_route(place, *method, route, seed));
    }
    return runs;
  });
  std::vector<std::vector<MethodRun>> by_place(driven_in.size());
  for (std::size_t p = 0; p < driven_in.size(); ++p) {
    for (const auto& runs : by_method) by_place[p].push_back(runs[p]);
  }
  return by_place;
}

std::string to_id(std::string name) {
  std::ranges::replace(name, ' ', '_');
  std::ranges::replace(name, '-', '_');
  return name;
}

// Targets of a method over all routes; nullopt: none.
struct RouteTargets {
  std::optional<Target> reached;
  std::optional<Target> elsewhere;
  std::optional<Target> offset;
  std::optional<Target> bytes;
};

// Adds the rows of a method over all routes of one kind.
void report_method(Reproduction& result, const std::string& id, const std::string& what,
                   const std::vector<MethodRun>& runs, bool reports_arrival,
                   const RouteTargets& targets = {}) {
  const auto count = [&](bool MethodRun::*member) {
    return count_where(runs, [&](const MethodRun& run) { return run.*member; });
  };
  add_rate(result, id + ".reached", what + ": reached to 50 cm", count(&MethodRun::has_reached),
           runs.size(), targets.reached);
  if (reports_arrival) {
    add_rate(result, id + ".elsewhere", what + ": arrivals reported elsewhere",
             count(&MethodRun::is_wrong), runs.size(), targets.elsewhere);
  }
  std::vector<double> offset_m;
  for (const MethodRun& run : runs) {
    if (run.has_reached) offset_m.insert(offset_m.end(), run.offset_m.begin(), run.offset_m.end());
  }
  if (offset_m.empty()) return;
  add_row(result, id + ".offset", what + ": median distance from the route, where it is reached",
          median(offset_m), "m", targets.offset);
}

void report_cost(Reproduction& result, const std::string& id, const std::string& what,
                 const std::vector<MethodRun>& runs, const std::optional<Target>& target = {}) {
  double bytes = 0.0;
  double length_m = 0.0;
  std::vector<double> picture_ms;
  for (const MethodRun& run : runs) {
    bytes += 0.01 * run.length_m * run.bytes_per_100_m;
    length_m += run.length_m;
    picture_ms.push_back(run.picture_ms);
  }
  add_row(result, id + ".bytes", what + ": bytes", 100.0 * bytes / length_m, "B/100 m", target);
  add_row(result, id + ".time", what + ": time a picture", median_figure(picture_ms), "ms");
}

// Moves all lamps and the sun to one side of the scene (1 north, -1 south) or removes them (0).
simulation::Scene light_from(simulation::Scene scene, int side) {
  const double middle_m = 0.5 * (scene.floor_low.y_m + scene.floor_high.y_m);
  std::erase_if(scene.lights, [&](const simulation::PointLight& lamp) {
    return side == 0 || side * (lamp.position.y_m - middle_m) < 0.0;
  });
  for (simulation::DirectionalLight& light : scene.directional_lights) {
    light.towards_light = Direction3::from_angles(side * 0.5 * std::numbers::pi, 0.8);
  }
  if (side == 0) scene.directional_lights.clear();
  return scene;
}

// Another day: a third of the movable things elsewhere, less light, the sun from another side.
simulation::Scene change_day(const simulation::Scene& scene, std::uint64_t seed) {
  simulation::ChangingScene changing(scene, seed);
  changing.simulate_day(1.0 / 3.0);
  simulation::Scene other = changing.scene(0.75);
  for (simulation::DirectionalLight& light : other.directional_lights) {
    light.towards_light = {-light.towards_light.y, light.towards_light.x, light.towards_light.z};
  }
  return other;
}

}  // namespace

struct RouteRuns {
  std::array<std::vector<MethodRun>, methods.size()> by_method;
};

std::shared_ptr<RouteRuns> make_route_runs() {
  return std::make_shared<RouteRuns>();
}

void RouteMethodExperiments::compare_routes(const std::string& scene, double length_m,
                                            int routes) const {
  RouteRuns runs;
  for (int variant = 0; variant < std::min(options.scenes, routes); ++variant) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(variant);
    const std::vector<RoutePlace> places{make_route_place(
        simulation::make_or_read_scene(options.data, scene, {.seed = seed}), executor)};
    for (int i = variant; i < routes; i += options.scenes) {
      const std::uint64_t route_seed = options.seed + 10 + static_cast<std::uint64_t>(i);
      const auto route = plan_winding_route(*places[0].free_space, length_m, route_seed);
      const auto of_route = compare_methods(places[0], places, route, route_seed, executor);
      for (std::size_t m = 0; m < methods.size(); ++m) runs.by_method[m].push_back(of_route[0][m]);
    }
  }
  const std::string length = std::to_string(std::lround(length_m));
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto method = methods[m]();
    const std::string name = method->name();
    const std::string id = "routes." + scene + "." + length + "." + to_id(name);
    const std::string what = name + ", routes of " + length + " m in " + scene;
    report_method(result, id, what, runs.by_method[m], method->reports_arrival());
    report_cost(result, id, what, runs.by_method[m]);
    std::ranges::copy(runs.by_method[m], std::back_inserter(all->by_method[m]));
  }
}

void RouteMethodExperiments::report_all_routes() const {
  if (all->by_method.front().empty()) return;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const auto method = methods[m]();
    const std::string name = method->name();
    const std::string id = "routes.all." + to_id(name);
    const std::string what = name + ", all routes";
    RouteTargets targets;
    if (m == 0) targets = {at_least(0.95), at_most(0.0), at_most(0.1), at_most(1000.0)};
    report_method(result, id, what, all->by_method[m], method->reports_arrival(), targets);
    report_cost(result, id, what, all->by_method[m], targets.bytes);
  }
}

void RouteMethodExperiments::compare_conditions(const std::string& scene, double length_m) const {
  const RoutePlace usual = make_route_place(
      simulation::make_or_read_scene(options.data, scene, {.seed = options.seed}), executor);
  const auto relight = [&](int side) {
    simulation::Scene lit = light_from(usual.scene, side);
    auto renderer =
        std::make_shared<const simulation::Renderer>(lit, simulation::RendererOptions{}, executor);
    return RoutePlace{{std::move(lit), usual.free_space, std::move(renderer)}, usual.frame};
  };
  RoutePlace higher = usual;
  higher.frame.camera_height_m += 0.5;
  RoutePlace tilted = usual;
  tilted.frame.tilt_rad = radians(5.0);
  const std::vector<RoutePlace> places{
      usual,
      relight(0),
      relight(1),
      relight(-1),
      make_route_place(change_day(usual.scene, options.seed), executor),
      higher,
      tilted};
  const std::array<std::string, 7> names{"with", "off", "left", "right", "day", "higher", "tilted"};
  std::vector<std::vector<std::vector<MethodRun>>> runs(
      places.size(), std::vector<std::vector<MethodRun>>(methods.size()));
  for (int i = 0; i < options.runs; ++i) {
    const std::uint64_t seed = options.seed + 100 + static_cast<std::uint64_t>(i);
    const auto route = plan_winding_route(*usual.free_space, length_m, seed);
    const auto of_route = compare_methods(usual, places, route, seed, executor);
    for (std::size_t p = 0; p < places.size(); ++p) {
      for (std::size_t m = 0; m < methods.size(); ++m) runs[p][m].push_back(of_route[p][m]);
    }
  }
  for (std::size_t p = 0; p < places.size(); ++p) {
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const auto method = methods[m]();
      const std::string name = method->name();
      report_method(result, "routes." + scene + "." + names[p] + "." + to_id(name),
                    name + ", routes of " + std::to_string(std::lround(length_m)) + " m in " +
                        scene + ", " + names[p],
                    runs[p][m], method->reports_arrival());
    }
  }
}

}  // namespace panonav::lab
