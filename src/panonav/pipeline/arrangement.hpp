#pragma once

#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Lowest weight, of 1, of a spring that becomes a link; those below contradict the others.
inline constexpr double min_spring_weight = 0.25;

/// Keeps an arrangement of the file's views in it: as the map "lattice", and as links where views
/// have none yet. Throws FileError.
void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file);

/// Returns the motions, by odometry, between consecutive pictures of the data set whose names the
/// memory has. Throws OptionError.
[[nodiscard]] std::vector<CoarseMotion> make_coarse_motions(
    const Dataset& recording, const VisualMemory& memory, const CoarseMotionOptions& options = {});

}  // namespace panonav
