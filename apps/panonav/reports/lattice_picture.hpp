#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// True if the memory knows enough positions of the largest component for a comparison.
[[nodiscard]] bool has_true_positions(const Lattice& lattice, const VisualMemory& memory);

/// Places of the largest component's views, laid over the positions that the memory knows; empty
/// for other views.
[[nodiscard]] std::vector<std::optional<Point2>> align_to_truth(const Lattice& lattice,
                                                                const VisualMemory& memory);

/// The largest component with its springs; where the memory knows positions, these stand before it.
[[nodiscard]] std::vector<viewer::MapPlot> draw_lattice(const Lattice& lattice,
                                                        const VisualMemory& memory);

/// Draws the largest component with its springs; where the memory knows positions, the map is laid
/// over them and they stand beside it. Throws what `write_plot` throws.
void write_lattice_picture(const std::filesystem::path& path, const Lattice& lattice,
                           const VisualMemory& memory);

}  // namespace panonav::command
