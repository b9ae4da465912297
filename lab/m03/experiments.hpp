#pragma once

#include <span>
#include <string>

#include "lab/m03/support.hpp"
#include "lab/reproduction.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

// Each appends rows and writes pictures into `options.out`. Over offices: at least one of them.

/// [M03] section 4.1, Global Localisation and figure 7 (1-3).
void reproduce_global_localisation(const TrackingReproductionOptions& options,
                                   std::span<const OfficeRuns> offices, Executor& executor,
                                   Reproduction& result);
/// [M03] section 4.1, Position Tracking and figure 7 (4-6).
void reproduce_position_tracking(const TrackingReproductionOptions& options,
                                 std::span<const OfficeRuns> offices, Executor& executor,
                                 Reproduction& result);
/// [M03] section 4.1, Kidnapped Robot and figures 8 and 9.
void reproduce_kidnapping(const TrackingReproductionOptions& options,
                          std::span<const OfficeRuns> offices, Executor& executor,
                          Reproduction& result);
/// Numbers of particles and kinds of odometry.
void reproduce_tracking_sweeps(const TrackingReproductionOptions& options,
                               std::span<const OfficeRuns> offices, Executor& executor,
                               Reproduction& result);

/// "A long indoor corridor with a loop where we face many false hypothesis": never surely wrong.
void reproduce_corridor(const TrackingReproductionOptions& options, Executor& executor,
                        Reproduction& result);
/// "A large outdoor environment where we are investigating the different nature of brightness
/// variations".
void reproduce_garden(const TrackingReproductionOptions& options, Executor& executor,
                      Reproduction& result);
/// A robot that leaves the memorised half of the scene `name` and returns.
void reproduce_leaving(const TrackingReproductionOptions& options, const std::string& name,
                       Executor& executor, Reproduction& result);
/// Global localisation in the world `name` of `options.data`. Throws FileError.
void reproduce_gazebo_world(const TrackingReproductionOptions& options, const std::string& name,
                            Executor& executor, Reproduction& result);
/// The recordings of `options.data`: sussex_route, gantry_plants. Throw FileError.
void reproduce_recorded_route(const TrackingReproductionOptions& options, Executor& executor,
                              Reproduction& result);
void reproduce_gantry(const TrackingReproductionOptions& options, Executor& executor,
                      Reproduction& result);

}  // namespace panonav::lab
