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
#include "panonav_simulation/place_recording.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

/// A place in which robots repeat routes.
struct RouteScene : simulation::SimulatedPlace {
  std::string name;
  simulation::LineCamera camera;
};
[[nodiscard]] RouteScene make_route_scene(simulation::Scene scene, const std::string& name,
                                          Executor& executor);

/// Plans a path of about `length_m` through random places, with room of 10 cm to either side of the
/// robot where the place has that much: shortest paths with rounded corners, which do not turn back
/// on the spot. Poses every `spacing_m`, headings along the path. The same seed gives the same
/// path. Throws ContractError unless both are above 0.
[[nodiscard]] std::vector<Pose2> plan_curved_route(const RouteScene& place, double length_m,
                                                   double spacing_m, std::uint64_t seed);

/// Records the lines that a robot sees along a path.
[[nodiscard]] RoutePanorama record_route(const RouteScene& place, const std::vector<Pose2>& way,
                                         std::uint64_t seed, Executor& executor);

/// Wheels that move more or less than commanded, and report the command.
struct DriftingWheels {
  double travel = 1.0;  ///< true over commanded
  double turn = 1.0;
  OdometryNoise noise;  ///< on top; only the random part
  [[nodiscard]] Pose2 execute(const Pose2& commanded, Random& random) const;
};

struct RouteRunOptions {
  bool back = false;
  double drift = 0.05;       ///< error of the wheels' travel and turn, either sign for a whole run
  double start_off_m = 0.3;  ///< beside the start of the route; the robot thinks it is at the start
  double step_m = 0.15;      ///< driven between two lines
};

/// A fix by a line.
struct RouteSighting {
  Pose2 pose;
  double along_m = 0.0;  ///< way along the route
};

/// A run that repeated a route.
struct RouteRun {
  std::vector<Pose2> truth;
  std::vector<std::optional<RouteSighting>> sightings;  ///< at these poses; empty: off the route
  std::vector<double> lateral_m;   ///< from the true place to the part of the way it should be at
  std::vector<double> position_m;  ///< error of the fixes
  std::size_t off_route = 0;       ///< lines that it took for not on this route
  bool arrived = false;            ///< by its own word
  std::size_t turned_aside = 0;    ///< steps at which something was in its way
  bool blocked = false;            ///< on all sides
  double end_distance_m = 0.0;     ///< from the end of the route

  /// True if the robot reports the end of the route within 0.2 m of it.
  [[nodiscard]] bool has_completed() const noexcept {
    return arrived && !blocked && end_distance_m <= 0.2;
  }
};

/// Repeats a route in closed loop: each line is fitted into the route panorama from where
/// the wheels put it, and the robot steers to the place a little ahead on the path. It feels
/// what is in its way and goes past, and drives a spiral when some lines one after the other are
/// not of the route. `tracker` is one of this route. The same seed gives the same run. Cost: a line
/// a step.
[[nodiscard]] RouteRun repeat_route(const RouteScene& place, RouteTracker tracker,
                                    const RouteRunOptions& options, std::uint64_t seed);

/// Returns the layers of the route and of the runs, every second one back, for a map.
[[nodiscard]] std::vector<viewer::MapLayer> make_route_layers(std::span<const Pose2> way,
                                                              std::span<const RouteRun> runs);

}  // namespace panonav::lab
