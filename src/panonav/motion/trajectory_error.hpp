#pragma once

#include <optional>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/trajectory.hpp"

namespace panonav {

/// Errors of an estimated trajectory (Sturm et al. 2012).
struct TrajectoryError {
  /// Options for comparing an estimate with the true trajectory.
  struct Options {
    /// Longest gap in the true trajectory that is interpolated; estimates in longer gaps are left
    /// out.
    double max_gap_s = 1.0;
    /// Distance along the true path over which relative errors are computed.
    double relative_distance_m = 1.0;
    bool align = true;              ///< false: both are in one frame already
    bool align_scale = false;       ///< with `align`: also fit the scale
    bool align_reflection = false;  ///< with `align`: allow a mirror image
    friend bool operator==(const Options&, const Options&) = default;
  };

  /// Summary statistics of absolute errors.
  struct Summary {
    double rms = 0.0;      ///< root mean square
    double mean = 0.0;     ///< arithmetic mean
    double median = 0.0;   ///< half of the errors are at most this
    double p95 = 0.0;      ///< 95 % are at most this
    double largest = 0.0;  ///< the greatest error of all
  };

  std::size_t pairs = 0;     ///< estimates with a true pose at their stamp
  std::size_t left_out = 0;  ///< estimates without a true pose
  /// Alignment applied to the estimate; the identity without `align`. `rms_m` equals
  /// `position_m.rms`.
  Alignment ground_truth_from_estimate;
  Summary position_m;   ///< absolute error of position, after alignment
  Summary heading_rad;  ///< absolute error of heading, after alignment; a reflected alignment
                        ///< turns headings round
  std::size_t relative_pairs = 0;         ///< 0: the path is shorter than relative_distance_m
  Summary relative_position_m;            ///< of the motion over relative_distance_m, scale applied
  Summary relative_heading_rad;           ///< error of the turn over that distance, absolute
  std::vector<double> position_errors_m;  ///< one for each pair, in time
};

void visit_options(TrajectoryError::Options& options, OptionVisitor& visitor);

/// Computes the errors of `estimate`: interpolates the truth at its stamps, aligns the positions by
/// least squares, and compares poses. nullopt if fewer than two estimates have a true pose. Throws
/// OptionError.
[[nodiscard]] std::optional<TrajectoryError> trajectory_error(
    const Trajectory& estimate, const Trajectory& truth,
    const TrajectoryError::Options& options = {});

}  // namespace panonav
