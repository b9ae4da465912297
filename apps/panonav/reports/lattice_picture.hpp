#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// Comparison of the largest component of an arrangement with the positions that the memory knows.
struct LatticeComparison {
  std::size_t compared = 0;               ///< views of that component with a true position
  double shape_difference = 1.0;          ///< mu [F11], 0 .. 1
  double with_reflection = 1.0;           ///< the same when a mirror image is allowed
  double rms_m = 0.0;                     ///< after the best alignment with a free scale
  double scale = 1.0;                     ///< metres for each unit of the lattice
  std::optional<double> trustworthiness;  ///< of 8 neighbours; empty where views are too few
  std::optional<double> continuity;
};
/// Empty where fewer than three views have a position, or all are at one place.
[[nodiscard]] std::optional<LatticeComparison> compare_with_ground_truth(
    const Lattice& lattice, const VisualMemory& memory);

/// True if the memory knows enough positions of the largest component for a comparison.
[[nodiscard]] bool is_known(const Lattice& lattice, const VisualMemory& memory);

/// Places of the largest component's views, laid over the positions that the memory knows; empty
/// for other views.
[[nodiscard]] std::vector<std::optional<Point2>> aligned_positions(const Lattice& lattice,
                                                                   const VisualMemory& memory);

/// The largest component with its springs; where the memory knows positions, these stand before it.
[[nodiscard]] std::vector<viewer::MapPlot> draw_lattice(const Lattice& lattice,
                                                        const VisualMemory& memory);

/// Draws the largest component with its springs; where the memory knows positions, the map is laid
/// over them and they stand beside it. Throws what `write_plot` throws.
void write_lattice_picture(const std::filesystem::path& path, const Lattice& lattice,
                           const VisualMemory& memory);

}  // namespace panonav::command
