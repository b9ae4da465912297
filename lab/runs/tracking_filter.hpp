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
  std::size_t step = 0;  ///< of the run
  LocalisationState state = LocalisationState::lost;
  bool answered = false;           ///< a pose was given
  double error_m = 0.0;            ///< of the heaviest mode; infinite when there is none
  double heading_error_rad = 0.0;  ///< of the same, absolute
  double nearest_mode_m = 0.0;     ///< error of the mode nearest to the truth
  std::size_t modes = 0;
  int particles = 0;
  int injected = 0;

  /// True if a pose was given and is within `radius_m`.
  [[nodiscard]] bool is_within(double radius_m) const { return answered && error_m < radius_m; }
  /// True if the state is localised and the error above `radius_m`.
  [[nodiscard]] bool is_confidently_wrong(double radius_m) const {
    return state == LocalisationState::localised && !(error_m <= radius_m);
  }
};
using TrackedRun = std::vector<TrackedImage>;

/// A filter and the robot that it runs on.
struct FilterSetting {
  MonteCarloOptions options;  ///< but for the injection, and the seed that each run has of its own
  InjectionMethod injection = InjectionMethod::explained;
  /// Number of particles for each reference, kept constant; empty: as the options say.
  std::optional<double> particles_per_reference;
  OdometryNoise odometry;          ///< of the robot
  OdometryNoise assumed_odometry;  ///< by the filter
  bool heading_known = false;      ///< at the start
};

/// Returns the paper's robot: holonomic, heading known and kept, no compass, as many particles as
/// references, nothing injected.
[[nodiscard]] FilterSetting paper_setting();
/// Returns a differential drive with unknown heading, compass on, as many particles as references.
[[nodiscard]] FilterSetting compass_setting(InjectionMethod injection);

/// Called after each step, also those without an image.
using StepObserver = std::function<void(std::size_t step, const MonteCarloLocaliser& filter,
                                        const MonteCarloEstimate& estimate)>;

/// Tracks one run by a filter. `seed` is that of the odometry and of the filter. Same arguments:
/// same bits.
[[nodiscard]] TrackedRun track_run(const TrackingPlace& place, const TrackingRun& run,
                                   const FilterSetting& setting, std::uint64_t seed,
                                   const StepObserver& observer = {});

/// Tracks all runs; run i has the seed `first_seed` + i.
[[nodiscard]] std::vector<TrackedRun> track_runs(const TrackingPlace& place,
                                                 std::span<const TrackingRun> runs,
                                                 const FilterSetting& setting,
                                                 std::uint64_t first_seed, Executor& executor);

/// Counts the images, from 1 at step `first_step`, until the answer is within `radius_m` and
/// stays so to the end of the run; empty when the last one is not.
[[nodiscard]] std::optional<int> images_until_localised(const TrackedRun& run, double radius_m,
                                                        std::size_t first_step = 0);
/// Counts the images until the first answer within `radius_m`, whatever follows.
[[nodiscard]] std::optional<int> images_until_first_fix(const TrackedRun& run, double radius_m,
                                                        std::size_t first_step = 0);

}  // namespace panonav::lab
