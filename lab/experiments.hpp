#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// The context of all experiments. Each experiment appends rows and writes images.
struct Experiments {
  const ReproductionOptions& options;
  Executor& executor;
  Reproduction& result;
};

/// A part of the experiments of a paper.
struct ReproductionStage {
  double cost = 1.0;  ///< relative, for the progress
  std::function<void()> run;
};
using ReproductionPlan = std::vector<ReproductionStage>;

// The stages of the papers that keep state between them; what `context` refers to must outlive
// them. Throw ContractError on options out of range.
[[nodiscard]] ReproductionPlan plan_m04(const Experiments& context);
[[nodiscard]] ReproductionPlan plan_s06(const Experiments& context);

struct OptionMinimum {
  const char* name;
  int value;
  int min;
};
/// Throws ContractError on the first value below its minimum.
void require_minima(std::initializer_list<OptionMinimum> options);

/// The experiments of [F11], and those that its authors left to future work.
struct MappingExperiments : Experiments {
  /// Figures 4 and 6 (a): 200 views 10 cm apart along the round trip of `loop`.
  void reproduce_first_set() const;
  /// Figures 5 and 6 (b): 150 views captured by threshold in `lab`.
  void reproduce_second_set() const;
  /// Measures the time from a mirror image to a pose.
  void measure_step_time() const;
  /// Places that look alike: closures in a corridor of identical doors.
  void reproduce_identical_doors() const;
  /// Maps paths of 60 m with two loops in a Gazebo world of `options.data`.
  void reproduce_world(const std::string& name) const;
  /// Maps the recordings of `options.data`: a route outdoors, a walk through a building.
  void reproduce_recordings() const;
  /// Measures time and memory at 100 views and at more, ten times each, up to `options.max_views`.
  void measure_large_maps() const;

  /// Makes variant `number` of a built-in scene.
  [[nodiscard]] simulation::PlaceRecording make_variant(const std::string& scene, int number) const;
};

/// Missions over the memory: [M04] figure 18, maps of drives, tours, routes and blocked paths.
struct NavigationExperiments : Experiments {
  /// [M04] figure 18: missions in a built-in scene whose references lie on a grid of `spacing_m`
  /// and are arranged by their similarity alone.
  void reproduce_grid_missions(const std::string& scene, double spacing_m) const;
  /// Missions over maps of drives through a built-in scene, or a Gazebo world of `options.data`: as
  /// remembered, in other light and with objects moved, and with a robot that is kidnapped.
  void reproduce_drive_missions(const std::string& scene) const;
  /// Variants of `loop`: tours of five goals, among people too, and with all components of
  /// signatures compared at each step instead of the first few in the open.
  void reproduce_tours() const;
  /// Variants of `loop`: the same missions over the map of a drive with and without the route that
  /// was recorded on it.
  void reproduce_route_missions() const;
  /// Variants of `loop` with a way blocked that has a detour, and with two blocked so that there
  /// is none.
  void reproduce_blocked_missions() const;
};

/// The experiments of [Y03], and those that its author left to future work.
struct RouteExperiments : Experiments {
  /// Reproduces section 5: drives across a straight path through `lab`, sweeps, time, the run to a
  /// goal; figures 3, 5, 9 and 10.
  void reproduce_lab_drives() const;
  /// Measures routes of 60 m repeated forward and back in closed loop through variants of `loop`,
  /// and how many bytes these routes take in a memory file.
  void reproduce_loop_routes() const;
  /// Measures the same in a Gazebo world of `options.data`.
  void reproduce_world_routes(const std::string& name) const;
  /// Localises along a real route outdoors: `sussex_route` of `options.data`.
  void reproduce_real_route() const;
};

}  // namespace panonav::lab
