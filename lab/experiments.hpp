#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Shared context of all experiments. An experiment appends its rows to `result` and writes its
/// images to `result.out`.
struct Experiments {
  const ReproductionOptions& options;
  Executor& executor;
  Reproduction& result;

  /// Returns the rendering of views with the optics of the options. `pixel_size`: of mirror images,
  /// as of `make_mirror_rendering`.
  [[nodiscard]] simulation::PanoramaRendering make_rendering(int rows, int columns,
                                                             int pixel_size = 1) const;
  /// Returns the rendering of mirror images with only the elevations that panoramas have, too;
  /// nullopt if the optics are not a mirror.
  [[nodiscard]] std::optional<simulation::PanoramaRendering> make_common_rendering(
      int rows, int columns) const;
};

/// One step of the reproduction of a paper.
struct ReproductionStage {
  double cost = 1.0;  ///< relative, for the progress display
  std::function<void()> run;
};
using ReproductionPlan = std::vector<ReproductionStage>;

// Plan the stages of the papers whose stages share state; the objects that `context` refers to must
// outlive the plan. Throw ContractError on options out of range.
[[nodiscard]] ReproductionPlan plan_m04(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_s06(const Experiments& context);

struct OptionMinimum {
  const char* name;
  int value;
  int min;
};
/// Throws ContractError on the first option whose value is below its minimum.
void require_minima(std::initializer_list<OptionMinimum> options);

/// The experiments of [F11], and those that its authors announced as future work.
struct MappingExperiments : Experiments {
  /// Reproduces figures 4 and 6 (a): 200 views 10 cm apart along the round trip of `loop`.
  void reproduce_first_set() const;
  /// Reproduces figures 5 and 6 (b): 150 views captured by an image difference threshold in `lab`.
  void reproduce_second_set() const;
  /// Measures the published rule in `hall`, whose walls are farther away.
  void measure_wide_room() const;
  /// Measures the time from a mirror image to a pose.
  void measure_step_time() const;
  /// Measures loop closures in a corridor of identical doors, where places look the same.
  void reproduce_identical_doors() const;
  /// Maps paths of 60 m with two loops in a Gazebo world of `options.data`.
  void reproduce_world(const std::string& name) const;
  /// Maps the recordings of `options.data`: a route outdoors, a walk through a building.
  void reproduce_recordings() const;
  /// Measures time and memory of maps of 100, 1000, ... views, up to `options.max_views`.
  void measure_large_maps() const;

  /// Makes variant `number` of a built-in scene.
  [[nodiscard]] simulation::PlaceRecording make_variant(const std::string& scene, int number) const;
};

/// Missions over a visual memory: [M04] figure 18, maps of drives, tours, routes and blocked paths.
struct NavigationExperiments : Experiments {
  /// Reproduces [M04] figure 18: missions in a built-in scene whose references lie on a grid of
  /// `spacing_m` and are arranged by their similarity alone.
  void reproduce_grid_missions(const std::string& scene, double spacing_m) const;
  /// Measures missions over maps of drives through a built-in scene or a Gazebo world of
  /// `options.data`: in the unchanged scene, with changed light and moved objects, and with a robot
  /// that is kidnapped.
  void reproduce_drive_missions(const std::string& scene) const;
  /// Measures tours of five goals in variants of `loop`: without and with people, and comparing all
  /// signature components at each step, where the default in open space is the first few.
  void reproduce_tours() const;
  /// Measures the same missions in variants of `loop` over the map of a drive, with and without the
  /// route that was recorded on it.
  void reproduce_route_missions() const;
  /// Measures missions in variants of `loop` with one path blocked, which leaves a detour, and with
  /// two blocked, which leaves none.
  void reproduce_blocked_missions() const;
  /// Measures explorations of a built-in scene or a Gazebo world of `options.data` by a robot with
  /// noisy odometry and with ranges or a bumper: share of the free floor that its views cover, and
  /// path length against a boustrophedon path with true poses.
  void reproduce_explorations(const std::string& scene) const;

  /// Makes a place for missions whose robot has the optics of the options. Its mirror images have
  /// 320 x 240 pixels, because a mission takes ten a second.
  [[nodiscard]] simulation::MissionPlace make_place(
      simulation::Scene scene, std::optional<Point2> inside = std::nullopt) const;
};

/// The experiments of [Y03], and those that its author announced as future work.
struct RouteExperiments : Experiments {
  /// Reproduces section 5 with figures 3, 5, 9 and 10: drives across a straight path through `lab`,
  /// parameter sweeps, run times, and the run to a goal.
  void reproduce_lab_drives() const;
  /// Measures routes of 60 m through variants of `loop`, repeated forward and back in closed loop,
  /// and the bytes that these routes need in a memory file.
  void reproduce_loop_routes() const;
  /// Measures the same as `reproduce_loop_routes` in a Gazebo world of `options.data`.
  void reproduce_world_routes(const std::string& name) const;
  /// Localises along a real route outdoors: `sussex_route` of `options.data`.
  void reproduce_real_route() const;
};

/// All runs of all methods along routes.
struct RouteRuns;
[[nodiscard]] std::shared_ptr<RouteRuns> make_route_runs();

/// Routes learnt once and driven again, by this library's memories of routes and by rivals on the
/// same pictures of 144 x 20, with odometry that is 5 % wrong.
struct RouteMethodExperiments : Experiments {
  std::shared_ptr<RouteRuns> all = make_route_runs();  ///< of `compare_routes`

  /// Measures some routes in `options.scenes` variants of a built-in scene, or in a Gazebo world:
  /// bytes, time a picture, routes reached, and distance from the route.
  void compare_routes(const std::string& scene, double length_m, int routes) const;
  /// Reports the same over all routes so far; nothing if there were none.
  void report_all_routes() const;
  /// Measures routes learnt in the usual light and driven again in the same light, without lamps
  /// and sun, with those of one side alone, on another day, 0.5 m higher, and tilted by 5 degrees.
  void compare_conditions(const std::string& scene, double length_m) const;
};

}  // namespace panonav::lab
