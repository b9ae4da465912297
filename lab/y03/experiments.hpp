#pragma once

#include <string>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

/// The experiments of [Y03] and what its author left to later work. Each appends rows and writes
/// pictures into `options.out`.
struct RouteExperiments {
  const RouteReproductionOptions& options;
  Executor& executor;
  Reproduction& result;

  /// Section 5: drives across a straight path through `lab`, sweeps, time, the run to a goal;
  /// figures 3, 5, 9 and 10.
  void reproduce_lab_drives(const ReproductionProgress& progress);
  /// 60 m repeated forward and back in closed loop through variants of `loop`, and how many bytes
  /// these routes take in a memory file.
  void reproduce_loop_routes();
  /// The same in a Gazebo world of `options.data`.
  void reproduce_world_routes(const std::string& name);
  /// A real route outdoors: `sussex_route` of `options.data`.
  void reproduce_real_route();
};

}  // namespace panonav::lab
