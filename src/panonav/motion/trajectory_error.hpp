#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/trajectory.hpp"

namespace panonav {

/// Errors of an estimated trajectory in space (Sturm et al. 2012). Pairs, alignment and errors are
/// defined as by the programs evo_ape and evo_rpe, so that the numbers can be compared.
struct TrajectoryError {
  /// Freedoms of the alignment of the estimate.
  enum class Align {
    rigid,       ///< rotation and translation (SE3)
    similarity,  ///< also the scale (Sim3)
    none         ///< nothing: both are in one frame already
  };

  /// Options for comparing an estimate with the true trajectory.
  struct Options {
    Align align = Align::rigid;     ///< applied before errors are computed
    bool align_reflection = false;  ///< unless `none`: allow a mirror image
    /// Largest difference between the stamps of a pair.
    double max_stamp_difference_s = 0.01;
    /// Length of the parts of the estimated path over which relative errors are computed.
    double relative_distance_m = 1.0;
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
  /// True if both trajectories stay at one height without tilt; the alignment then rotates only
  /// about z, so that it cannot turn the robot over. False with `Align::none`.
  bool planar = false;
  Alignment3 truth_from_estimate;  ///< applied to the estimate; the identity with `Align::none`
  Summary position_m;              ///< absolute error of position, after alignment
  /// Angle of the rotation between estimate and truth, after alignment.
  Summary rotation_rad;
  std::size_t relative_pairs = 0;         ///< 0: the path is shorter than two parts
  Summary relative_position_m;            ///< of the motion over a part, scale applied
  Summary relative_rotation_rad;          ///< angle between estimated and true rotation over a part
  std::vector<double> position_errors_m;  ///< one for each pair, in time
};

void visit_options(TrajectoryError::Options& options, OptionVisitor& visitor);

/// True if all poses have one height and no tilt, up to rounding.
[[nodiscard]] bool is_planar(std::span<const StampedPose3> poses);

/// Indices of an estimated and a true pose of one time.
struct PosePair {
  std::size_t estimate = 0;  ///< index into the estimate
  std::size_t truth = 0;     ///< index into the true poses
  friend bool operator==(const PosePair&, const PosePair&) = default;
};

/// Pairs each pose of the trajectory with fewer poses (if equal: of the estimate) with the pose of
/// the other whose stamp is nearest, if they differ by at most `max_stamp_difference_s`. Stamps
/// must ascend. O(n log n).
[[nodiscard]] std::vector<PosePair> pair_by_stamp(std::span<const StampedPose3> estimate,
                                                  std::span<const StampedPose3> truth,
                                                  double max_stamp_difference_s);

/// Computes the errors of `estimate`: pairs its poses with true ones (`pair_by_stamp`), aligns the
/// positions by least squares, and compares poses. Relative errors are those of consecutive parts
/// of the path. nullopt for fewer than two pairs. Throws OptionError.
[[nodiscard]] std::optional<TrajectoryError> trajectory_error(
    std::span<const StampedPose3> estimate, std::span<const StampedPose3> truth,
    const TrajectoryError::Options& options = {});

/// Computes the errors of a trajectory in the plane.
[[nodiscard]] std::optional<TrajectoryError> trajectory_error(
    const Trajectory& estimate, const Trajectory& truth,
    const TrajectoryError::Options& options = {});

}  // namespace panonav
