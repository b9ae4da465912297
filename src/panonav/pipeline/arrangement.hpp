#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Smallest weight (of 1) of a spring that becomes a link; springs of smaller weight contradict the
/// others.
inline constexpr double min_spring_weight = 0.25;

/// Stores an arrangement of the file's views in the file: as the map "lattice", and as links
/// between views that have none yet. Throws FileError.
void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file);

/// Returns the motions between consecutive images of the data set, by odometry; images whose names
/// the memory does not have are left out. Throws OptionError.
[[nodiscard]] std::vector<CoarseMotion> make_coarse_motions(
    const Dataset& recording, const VisualMemory& memory, const CoarseMotionOptions& options = {});

/// Returns the number of springs with a weight below `min_spring_weight`.
[[nodiscard]] std::size_t count_rejected_springs(const Lattice& lattice);

/// True if all arranged views have a stamp.
[[nodiscard]] bool has_stamps(const Lattice& lattice, const VisualMemory& memory);

/// Returns the poses of the largest component as a trajectory, ordered by stamp. If any view has no
/// stamp, the view ids serve as stamps. Throws ContractError if two views have the same stamp.
[[nodiscard]] std::vector<StampedPose> make_trajectory(const Lattice& lattice,
                                                       const VisualMemory& memory);

/// Returns the arranged positions (first) and the known positions (second) of those views of the
/// largest component whose position the memory knows.
[[nodiscard]] std::pair<std::vector<Point2>, std::vector<Point2>> collect_known_positions(
    const Lattice& lattice, const VisualMemory& memory);

/// Compares the largest component with the positions that the memory knows. Returns nullopt if
/// fewer than three views have a position, or all positions are equal.
[[nodiscard]] std::optional<MapComparison> compare_with_ground_truth(const Lattice& lattice,
                                                                     const VisualMemory& memory);

}  // namespace panonav
