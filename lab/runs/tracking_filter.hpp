#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lab/runs/injection_rules.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav::lab {

/// State of the filter after one image.
struct TrackedImage {
  std::size_t step = 0;  ///< index of the step in the run
  LocalisationState state = LocalisationState::lost;
  bool answered = false;           ///< the filter estimated a pose
  double error_m = 0.0;            ///< of the heaviest mode; infinite without a mode
  double heading_error_rad = 0.0;  ///< of the heaviest mode, absolute; pi without a mode
  double nearest_mode_m = 0.0;     ///< error of the mode nearest to the true position
  std::size_t modes = 0;
  int particles = 0;
  int injected = 0;

  /// True if the filter estimated a pose and its error is below `radius_m`.
  [[nodiscard]] bool is_within(double radius_m) const { return answered && error_m < radius_m; }
  /// True if the filter reports localised but its error is above `radius_m`.
  [[nodiscard]] bool is_confidently_wrong(double radius_m) const {
    return state == LocalisationState::localised && !(error_m <= radius_m);
  }
};
using TrackedRun = std::vector<TrackedImage>;

/// Settings of a filter and of the robot that it tracks.
struct FilterSetting {
  MonteCarloOptions options;  ///< except injection and seed, which are set per run
  InjectionMethod injection = InjectionMethod::explained;
  /// Number of particles per reference, kept constant; nullopt: limits as in `options`.
  std::optional<double> particles_per_reference;
  OdometryNoise odometry;          ///< of the simulated robot
  OdometryNoise assumed_odometry;  ///< noise model of the filter
  bool heading_known = false;      ///< the filter knows the first heading
};

/// Returns the robot and filter of [M03]: holonomic, heading known and constant, no compass, as
/// many particles as references, no injection.
[[nodiscard]] FilterSetting paper_setting();
/// Returns a differential robot with unknown heading and a filter that uses the compass, with as
/// many particles as references.
[[nodiscard]] FilterSetting compass_setting(InjectionMethod injection);

/// Called after each step, including steps without an image.
using StepObserver = std::function<void(std::size_t step, const MonteCarloLocaliser& filter,
                                        const MonteCarloEstimate& estimate)>;

/// Tracks one run by a filter. `seed` seeds both the odometry and the filter. The same arguments
/// give the same bits.
[[nodiscard]] TrackedRun track_run(const TrackingPlace& place, const TrackingRun& run,
                                   const FilterSetting& setting, std::uint64_t seed,
                                   const StepObserver& observer = {});

/// Tracks all runs; run i uses the seed `first_seed` + i.
[[nodiscard]] std::vector<TrackedRun> track_runs(const TrackingPlace& place,
                                                 std::span<const TrackingRun> runs,
                                                 const FilterSetting& setting,
                                                 std::uint64_t first_seed, Executor& executor);

/// Counts the images from step `first_step` on (that image is number 1) until the error is below
/// `radius_m` and remains so to the end of the run; nullopt if the error of the last image is
/// larger.
[[nodiscard]] std::optional<int> images_until_localised(const TrackedRun& run, double radius_m,
                                                        std::size_t first_step = 0);
/// Counts the images from step `first_step` on until the error is below `radius_m` for the first
/// time; nullopt if never.
[[nodiscard]] std::optional<int> images_until_first_fix(const TrackedRun& run, double radius_m,
                                                        std::size_t first_step = 0);

}  // namespace panonav::lab
