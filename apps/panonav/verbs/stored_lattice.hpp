#pragma once

#include "panonav/mapping/lattice.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// Springs that kept less than this of themselves contradict the others and become no links.
inline constexpr double min_spring_weight = 0.25;

/// Keeps an arrangement of the file's views in it: as the map "lattice", and as links where views
/// have none yet. Throws FileError.
void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file);

}  // namespace panonav::command
