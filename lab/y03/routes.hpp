#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lab/reproduction.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav_simulation/line_camera.hpp"
#include "panonav_simulation/obstacle_sense.hpp"
#include "panonav_simulation/place_recording.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

/// A simulated place in which robots repeat routes.
struct RouteScene : simulation::SimulatedPlace {
  std::string name;
  simulation::LineCamera camera;
};
[[nodiscard]] RouteScene make_route_scene(simulation::Scene scene, const std::string& name,
                                          Executor& executor);

/// Plans a path of about `length_m` through random places: shortest paths with rounded corners,
/// without turns on the spot, with 10 cm clearance on both sides of the robot where possible. Poses
/// every `spacing_m`, headings along the path. The same seed gives the same path. Throws
/// ContractError unless both lengths are above 0.
[[nodiscard]] std::vector<Pose2> plan_curved_route(const RouteScene& place, double length_m,
                                                   double spacing_m, std::uint64_t seed);

/// Records the route panorama of the lines that a robot sees along a path.
[[nodiscard]] RoutePanorama record_route(const RouteScene& place, const std::vector<Pose2>& poses,
                                         std::uint64_t seed, Executor& executor);

/// Wheels with a scale error: they move more or less than commanded, but report the command.
struct ScaleErrorWheels {
  double travel = 1.0;  ///< true distance over commanded distance
  double turn = 1.0;
  OdometryNoise noise;  ///< additional random error
  [[nodiscard]] Pose2 execute(const Pose2& commanded, Random& random) const;
};

struct RouteRunOptions {
  bool back = false;
  double wheel_scale_error = 0.05;  ///< scale error of travel and turn, random sign per run
  double start_offset_m = 0.3;      ///< lateral; the robot assumes the start of the route
  double step_m = 0.15;             ///< driven between two lines
  simulation::ObstacleSensor sensor = simulation::ObstacleSensor::bumper;
};

/// A pose estimated from one line.
struct RouteLineFix {
  Pose2 pose;
  double along_m = 0.0;  ///< path length along the route
};

/// The path and the results of one run that repeated a route.
struct RouteRun {
  std::vector<Pose2> truth;
  std::vector<std::optional<RouteLineFix>> line_fixes;  ///< per pose; nullopt: off the route
  std::vector<double> lateral_m;   ///< true distance from the expected part of the route
  std::vector<double> position_m;  ///< error of the fixes
  std::size_t off_route = 0;       ///< lines that were not recognised as of this route
  bool arrived = false;            ///< the robot reported the end of the route
  std::size_t obstacle_steps = 0;  ///< steps at which it touched or avoided an obstacle
  bool blocked = false;            ///< obstacles in all directions
  double end_distance_m = 0.0;     ///< from the end of the route

  /// True if the robot reports the end of the route and is within 0.2 m of it.
  [[nodiscard]] bool has_completed() const noexcept {
    return arrived && !blocked && end_distance_m <= 0.2;
  }
};

/// Repeats a route in closed loop: the tracker localises each line in the route panorama from the
/// pose predicted by the wheels, and the robot steers to a point a little ahead on the path. It
/// drives around obstacles as far as its sensor knows them, and drives a spiral after several lines
/// that are not of the route. `tracker` must be made from this route. The same seed gives the same
/// run. Cost: one rendered line per step.
[[nodiscard]] RouteRun repeat_route(const RouteScene& place, RouteTracker tracker,
                                    const RouteRunOptions& options, std::uint64_t seed);

/// Returns map layers of the route and of the runs, of which every second one is backwards.
[[nodiscard]] std::vector<viewer::MapLayer> make_route_layers(std::span<const Pose2> poses,
                                                              std::span<const RouteRun> runs);

}  // namespace panonav::lab
