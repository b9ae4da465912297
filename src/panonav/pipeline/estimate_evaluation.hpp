#pragma once

#include <filesystem>
#include <optional>

#include "panonav/mapping/map_measures.hpp"
#include "panonav/motion/trajectory_error.hpp"

namespace panonav {

/// Errors of an estimated trajectory or map.
struct EstimateEvaluation {
  TrajectoryError trajectory;        ///< errors of the poses
  std::optional<MapComparison> map;  ///< nullopt if `is_comparable` is false
  std::optional<MapComparison::Closures>
      closures;  ///< loop closures of a map; nullopt for a trajectory
};

/// Compares an estimate with a true trajectory (TUM text or CSV). The estimate is a trajectory, or
/// a memory file (NAME.panonav) with a map stored by `Mapper`, of which only the first component is
/// compared. Returns nullopt if fewer than two poses have a true pose at their stamp. Throws
/// FileError, also if a view of the map has no stamp; OptionError. Cost: that of
/// `compare_positions`.
[[nodiscard]] std::optional<EstimateEvaluation> evaluate_estimate(
    const std::filesystem::path& estimate, const std::filesystem::path& truth,
    const TrajectoryError::Options& options = {});

}  // namespace panonav
