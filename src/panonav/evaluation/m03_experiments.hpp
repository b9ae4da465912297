#pragma once

#include <span>

#include "panonav/core/executor.hpp"
#include "panonav/evaluation/m03_support.hpp"
#include "panonav/evaluation/reproduction.hpp"

namespace panonav {

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

}  // namespace panonav
