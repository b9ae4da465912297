#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// True if the memory has enough positions of views in the largest component for a comparison.
[[nodiscard]] bool has_true_positions(const Lattice& lattice, const VisualMemory& memory);

/// Returns the positions of the largest component's views, aligned with those in the memory if
/// there are enough; nullopt for other views.
[[nodiscard]] std::vector<std::optional<Point2>> align_to_truth(const Lattice& lattice,
                                                                const VisualMemory& memory);

/// Draws the largest component with its springs. If the memory has positions, a plot of these comes
/// first.
[[nodiscard]] std::vector<viewer::MapPlot> draw_lattice(const Lattice& lattice,
                                                        const VisualMemory& memory);

/// Writes the largest component with its springs as a picture. If the memory has positions, the map
/// is aligned with them, and they are shown next to it. Throws like `write_plot`.
void write_lattice_picture(const std::filesystem::path& path, const Lattice& lattice,
                           const VisualMemory& memory);

}  // namespace panonav::command
