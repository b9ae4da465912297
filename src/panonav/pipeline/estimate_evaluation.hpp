#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "panonav/io/trajectory_file.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/motion/trajectory_error.hpp"

namespace panonav {

/// An estimated trajectory and, if it comes from a memory file, its map.
struct TrajectoryEstimate {
  TrajectoryFile trajectory;          ///< of a map: the poses of its first component
  std::optional<TopologicalMap> map;  ///< stored by `Mapper`
  std::map<ViewId, double> stamp_s;   ///< of the views of the map
};

/// Errors of an estimated trajectory or map.
struct EstimateEvaluation {
  /// Criterion by which estimated and true poses are paired.
  enum class Pairing {
    stamp,         ///< by the nearest stamp
    image_number,  ///< by the number of the image, as both files have numbers instead of stamps
    order          ///< by the order of the poses, as a file has no stamps
  };
  TrajectoryError trajectory;        ///< errors of the poses, in the unit of the true poses
  Pairing pairing = Pairing::stamp;  ///< of estimated and true poses
  /// False: the estimate or the truth has only positions, so there are no errors of rotation and no
  /// relative errors.
  bool has_rotations = true;
  /// Agreement of the positions in the plane; nullopt if they are not in one plane or
  /// `is_comparable` is false.
  std::optional<MapComparison> map;
  std::optional<MapComparison::Closures>
      closures;  ///< loop closures of a map; nullopt for a trajectory
};

/// Reads an estimate: a trajectory file, or a memory file (NAME.panonav) with a map stored by
/// `Mapper`. Throws FileError, also if a view of the map has no stamp.
[[nodiscard]] TrajectoryEstimate read_estimate(const std::filesystem::path& path);

/// Compares an estimate with the true poses. If only one of them has stamps, or one has neither
/// stamps nor image numbers, poses are paired by their order, and ContractError is thrown unless
/// both have equally many; also if only one is metric and the alignment has no scale. Returns
/// nullopt for fewer than two pairs. Throws OptionError. Cost: that of `compare_positions`.
[[nodiscard]] std::optional<EstimateEvaluation> evaluate_estimate(
    TrajectoryEstimate estimate, TrajectoryFile truth,
    const TrajectoryError::Options& options = {});

}  // namespace panonav
