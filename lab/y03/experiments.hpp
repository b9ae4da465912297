#pragma once

#include <string>

#include "lab/rows.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

// The experiments of [Y03] and what its author left to later work. Each appends rows and writes
// pictures into `options.out`.

/// Section 5: drives across a straight path through `lab`, sweeps, time, the run to a goal;
/// figures 3, 5, 9 and 10.
void reproduce_lab_drives(const RouteReproductionOptions& options, Executor& executor,
                          const ReproductionProgress& progress, Reproduction& result);
/// 60 m repeated forward and back in closed loop through variants of `loop`, and how many bytes
/// these routes take in a memory file.
void reproduce_loop_routes(const RouteReproductionOptions& options, Executor& executor,
                           Reproduction& result);
/// The same in a Gazebo world of `options.data`.
void reproduce_world_routes(const RouteReproductionOptions& options, const std::string& name,
                            Executor& executor, Reproduction& result);
/// A real route outdoors: `sussex_route` of `options.data`.
void reproduce_real_route(const RouteReproductionOptions& options, Executor& executor,
                          Reproduction& result);

}  // namespace panonav::lab
