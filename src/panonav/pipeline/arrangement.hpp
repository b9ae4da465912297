#pragma once

#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Springs that kept less than this of themselves contradict the others and become no links.
inline constexpr double min_spring_weight = 0.25;

/// Keeps an arrangement of the file's views in it: as the map "lattice", and as links where views
/// have none yet. Throws FileError.
void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file);

/// Motion between consecutive pictures of the data set that the memory knows by name, by their
/// odometry. Throws OptionError.
[[nodiscard]] std::vector<CoarseMotion> motions_between(const Dataset& recording,
                                                        const VisualMemory& memory,
                                                        const CoarseMotionOptions& options = {});

}  // namespace panonav
