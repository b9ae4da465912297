#include "experiments/runs/chain_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "experiments/runs/simulated_robot.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {

std::vector<std::vector<Pose2>> random_routes(const FreeSpace& space, int count, double length_m,
                                              double spacing_m, std::uint64_t seed) {
  require(length_m > 0.0, "length of a route", length_m, "> 0");
  require(spacing_m > 0.0, "spacing of a route", spacing_m, "> 0");
  std::vector<std::vector<Pose2>> routes;
  for (int number = 0; number < count; ++number) {
    Random random(seed, static_cast<std::uint64_t>(number));
    std::vector<Pose2> corners{space.random_pose(random)};
    double way_m = 0.0;
    while (way_m < length_m) {
      const auto leg =
          space.shortest_path(corners.back().position(), space.random_pose(random).position());
      if (!leg) continue;
      for (const Point2& place : std::span(*leg).subspan(1)) {
        way_m += distance(corners.back().position(), place);
        corners.push_back({place.x_m, place.y_m, 0.0});
      }
    }
    std::vector<Pose2> route = resample(corners, spacing_m);
    for (std::size_t i = 0; i + 1 < route.size(); ++i) {
      route[i].heading_rad =
          wrap_angle(std::atan2(route[i + 1].y_m - route[i].y_m, route[i + 1].x_m - route[i].x_m));
    }
    if (route.size() > 1) route.back().heading_rad = route[route.size() - 2].heading_rad;
    routes.push_back(std::move(route));
  }
  return routes;
}

SnapshotChain record_chain(const HomingPlace& place, std::span<const Pose2> route,
                           const OdometryNoise& odometry, const ChainRecorderOptions& options,
                           const FourierHomingOptions& vector, std::uint64_t seed) {
  require(!route.empty(), "poses of the route", 0.0, ">= 1");
  ChainRecorder recorder(options, vector);
  SimulatedOdometry wheels(odometry, Random(seed, 3).next());
  Random noise_of_views(seed, 4);
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Pose2 before = wheels.pose();
    if (i > 0) wheels.advance(inverse(route[i - 1]) * route[i]);
    recorder.add(take_homing_view(place, route[i], noise_of_views.next()),
                 inverse(before) * wheels.pose());
  }
  return recorder.finish();
}

bool ChainRun::completes(double radius_m) const noexcept {
  return state == ChainState::finished && end_distance_m <= radius_m;
}

double distance_from_route_m(Point2 place, std::span<const Pose2> route) {
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Point2 a = route[i > 0 ? i - 1 : 0].position();
    const Point2 b = route[i].position();
    const double dx = b.x_m - a.x_m;
    const double dy = b.y_m - a.y_m;
    const double square = dx * dx + dy * dy;
    const double along =
        square > 0.0 ? ((place.x_m - a.x_m) * dx + (place.y_m - a.y_m) * dy) / square : 0.0;
    const double t = std::clamp(along, 0.0, 1.0);
    least_m = std::min(least_m, distance(place, {a.x_m + t * dx, a.y_m + t * dy}));
  }
  return least_m;
}

ChainRun follow_chain(const HomingPlace& place, const SnapshotChain& chain,
                      std::span<const Pose2> route, const Pose2& start,
                      const ChainRunOptions& options, std::uint64_t seed) {
  require(!route.empty(), "poses of the route", 0.0, ">= 1");
  ChainFollower follower(chain, options.direction, options.follower, options.pursuit,
                         options.vector);
  SimulatedRobot robot(*place.free_space, options.motion, options.obstacles, start, seed);
  SimulatedOdometry wheels(options.odometry, Random(seed, 3).next());
  Random noise_of_views(seed, 2);
  const Point2 end =
      (options.direction == ChainDirection::forward ? route.back() : route.front()).position();
  ChainRun run;
  Pose2 moved;
  for (int step = 0; step <= options.most_steps; ++step) {
    run.path.push_back(robot.pose());
    run.lateral_m.push_back(distance_from_route_m(robot.pose().position(), route));
    const ChainDecision decision =
        follower.decide(take_homing_view(place, robot.pose(), noise_of_views.next()), moved);
    run.state = decision.state;
    if (decision.state != ChainState::following) break;
    const auto direction_rad = robot.free_direction(decision.turn_rad, decision.advance_m);
    if (!direction_rad) {
      run.blocked = true;
      break;
    }
    const Pose2 true_before = robot.pose();
    const Pose2 shown_before = wheels.pose();
    const bool whole = robot.go(*direction_rad, decision.advance_m);
    if (!whole && options.obstacles == ObstacleRule::stop) {
      run.blocked = true;
      break;
    }
    wheels.advance(inverse(true_before) * robot.pose());
    moved = inverse(shown_before) * wheels.pose();
  }
  run.end_distance_m = distance(robot.pose().position(), end);
  return run;
}

}  // namespace panonav
