// Routes repeated along chains of snapshots.

#include "lab/s06/chains.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::lab {

namespace {

constexpr double route_length_m = 60.0;
constexpr double pose_spacing_m = 0.1;
constexpr double completion_radius_m = 0.5;
constexpr double max_steps = 1000.0;
constexpr double max_steps_per_metre = 5.0;

}  // namespace

HomingCamera chain_camera() {
  HomingCamera camera;
  camera.rendering = {.rows = 8, .columns = 128, .rays_per_axis = 2};
  camera.components = 6;
  return camera;
}

std::vector<std::vector<Pose2>> plan_random_routes(const simulation::FreeSpace& space, int count,
                                                   double length_m, double spacing_m,
                                                   std::uint64_t seed) {
  require(length_m > 0.0, "length of a route", length_m, "> 0");
  require(spacing_m > 0.0, "spacing of a route", spacing_m, "> 0");
  std::vector<std::vector<Pose2>> routes;
  for (int number = 0; number < count; ++number) {
    Random random(seed, static_cast<std::uint64_t>(number));
    std::vector<Pose2> corners{space.random_pose(random)};
    double path_m = 0.0;
    while (path_m < length_m) {
      const auto leg =
          space.shortest_path(corners.back().position(), space.random_pose(random).position());
      if (!leg) continue;
      for (const Point2& place : std::span(*leg).subspan(1)) {
        path_m += distance(corners.back().position(), place);
        corners.push_back({place.x_m, place.y_m, 0.0});
      }
    }
    std::vector<Pose2> route = simulation::resample(corners, spacing_m);
    simulation::face_path(route);
    for (Pose2& pose : route) pose.heading_rad = wrap_angle(pose.heading_rad);
    routes.push_back(std::move(route));
  }
  return routes;
}

DriftingOdometry::DriftingOdometry(const ChainOdometry& limits, Random& random)
    : scale_(1.0 + random.uniform(-limits.distance_error, limits.distance_error)),
      turn_rad_per_m_(
          random.uniform(-limits.heading_error_rad_per_m, limits.heading_error_rad_per_m)) {
  const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  wind_m_per_m_ = {limits.drift * std::cos(direction_rad), limits.drift * std::sin(direction_rad)};
}

Pose2 DriftingOdometry::measure(const Pose2& from, const Pose2& to) const {
  const Pose2 step = inverse(from) * to;
  const double length_m = std::hypot(step.x_m, step.y_m);
  const Point2 wind = Pose2{0.0, 0.0, -from.heading_rad} * wind_m_per_m_;
  return {scale_ * (step.x_m - length_m * wind.x_m), scale_ * (step.y_m - length_m * wind.y_m),
          wrap_angle(step.heading_rad + turn_rad_per_m_ * length_m)};
}

SnapshotChain record_chain(const HomingPlace& place, std::span<const Pose2> route,
                           const ChainSpacing& spacing, std::uint64_t seed) {
  ChainRecorder recorder({}, spacing);
  Random errors(seed, 3);
  const DriftingOdometry odometry({}, errors);
  Random noise_of_views(seed, 4);
  for (std::size_t i = 0; i < route.size(); ++i) {
    recorder.add(capture_chain_view(place, route[i], noise_of_views.next()),
                 i == 0 ? Pose2{} : odometry.measure(route[i - 1], route[i]));
  }
  return recorder.finish();
}

bool ChainRun::has_completed(double radius_m) const noexcept {
  return state == ChainState::arrived && end_distance_m <= radius_m;
}

bool ChainRun::has_arrived_elsewhere(double radius_m) const noexcept {
  return state == ChainState::arrived && end_distance_m > radius_m;
}

ChainRun follow_chain(const HomingPlace& place, const SnapshotChain& chain,
                      std::span<const Pose2> route, ChainDirection direction, std::uint64_t seed,
                      simulation::ObstacleSensor sensor) {
  require(!route.empty(), "poses of the route", 0.0, ">= 1");
  const bool forward = direction == ChainDirection::forward;
  Pose2 start = forward ? route.front() : route.back();
  const Pose2& end = forward ? route.back() : route.front();
  Random errors(seed, forward ? 5 : 6);
  const DriftingOdometry odometry({}, errors);
  start.heading_rad = errors.uniform(-std::numbers::pi, std::numbers::pi);
  ChainFollower follower(chain, direction);
  simulation::SimulatedRobot robot(*place.free_space, {}, simulation::ObstacleRule::pass, start,
                                   seed, sensor, place.floor_camera.get());
  Random noise_of_views(seed, 2);
  ChainRun run;
  Pose2 moved;
  const double last_step = max_steps + max_steps_per_metre * chain.length_m();
  for (int step = 0; step <= last_step; ++step) {
    run.path.push_back(robot.pose());
    run.lateral_m.push_back(simulation::distance_from_route_m(robot.pose().position(), route));
    const ChainDecision decision =
        follower.decide(capture_chain_view(place, robot.pose(), noise_of_views.next()), moved);
    run.state = decision.state;
    if (run.state == ChainState::arrived || run.state == ChainState::lost) break;
    const Pose2 before = robot.pose();
    if (robot.drive(decision.turn_rad, decision.advance_m).is_stopped) break;
    moved = odometry.measure(before, robot.pose());
  }
  run.end_distance_m = distance(robot.pose().position(), end.position());
  return run;
}

void reproduce_snapshot_chains(const HomingPlace& place, const std::string& name,
                               std::uint64_t seed, int routes, Executor& executor,
                               Reproduction& reproduction) {
  require(routes >= 1, "routes", routes, ">= 1");
  const auto random_routes =
      plan_random_routes(*place.free_space, routes, route_length_m, pose_spacing_m, seed);
  constexpr std::size_t directions = 2;
  std::vector<SnapshotChain> chains(random_routes.size());
  std::vector<ChainRun> runs(random_routes.size() * directions);
  executor.for_each_chunk(
      random_routes.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t i = begin; i < end; ++i) {
          chains[i] = record_chain(place, random_routes[i], {}, seed + i);
          for (const auto direction : {ChainDirection::forward, ChainDirection::back}) {
            runs[directions * i + static_cast<std::size_t>(direction)] =
                follow_chain(place, chains[i], random_routes[i], direction, seed + i);
          }
        }
      });

  std::size_t completed = 0;
  std::size_t elsewhere = 0;
  std::vector<double> offset_m;
  std::vector<double> mean_m;
  std::vector<double> worst_m;
  for (const ChainRun& run : runs) {
    completed += run.has_completed(completion_radius_m) ? 1 : 0;
    elsewhere += run.has_arrived_elsewhere(completion_radius_m) ? 1 : 0;
    if (run.state == ChainState::arrived) offset_m.push_back(run.end_distance_m);
    double sum_m = 0.0;
    for (const double lateral_m : run.lateral_m) sum_m += lateral_m;
    mean_m.push_back(sum_m / static_cast<double>(run.lateral_m.size()));
    worst_m.push_back(*std::max_element(run.lateral_m.begin(), run.lateral_m.end()));
  }
  std::vector<double> spacing_m;
  std::vector<double> bytes;
  for (const SnapshotChain& chain : chains) {
    spacing_m.push_back(chain.length_m() / static_cast<double>(chain.snapshots() - 1));
    bytes.push_back(chain.bytes_per_100_m());
  }
  const std::string id = "s06.chain." + name;
  const std::string what = "chains of snapshots along 60 m in " + name;
  add_rate(reproduction, id + ".completed",
           what + ", forward and back: driven to within 50 cm of the end", completed, runs.size());
  add_rate(reproduction, id + ".elsewhere", what + ": reported arrivals elsewhere", elsewhere,
           runs.size());
  if (!offset_m.empty()) {
    add_median(reproduction, id + ".offset", what + ": offset where it has arrived", "m", offset_m);
  }
  add_mean(reproduction, id + ".lateral", what + ": mean distance from the route", "m", mean_m);
  add_median(reproduction, id + ".lateral_worst", what + ": largest distance from the route", "m",
             worst_m);
  add_mean(reproduction, id + ".spacing", what + ": distance between snapshots", "m", spacing_m);
  add_mean(reproduction, id + ".bytes", what + ": size", "B/100 m", bytes);
}

void reproduce_snapshot_chains(int routes, const Experiments& context) {
  for (const char* const name : {"office", "hall", "loop", "corridor"}) {
    const HomingPlace place =
        make_homing_place(simulation::make_scene(name, {.seed = context.options.seed}),
                          chain_camera(), context.executor);
    reproduce_snapshot_chains(place, name, context.options.seed, routes, context.executor,
                              context.result);
  }
}

}  // namespace panonav::lab
