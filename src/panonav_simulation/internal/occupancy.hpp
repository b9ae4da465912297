#pragma once

#include <cstdint>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A raster over the plane: cell (i, j) covers [low + (i, j) cell, low + (i + 1, j + 1) cell].
struct Raster {
  Point2 low;
  double cell_m = 0.025;
  int columns = 0;
  int rows = 0;
};

/// Returns 1 for every cell over which a triangle of the scene has a point at a height in low_z ..
/// high_z, row-major. Cells that a triangle only touches count.
[[nodiscard]] std::vector<std::uint8_t> occupied_cells(const Scene& scene, const Raster& raster,
                                                       double low_z_m, double high_z_m);

/// Returns the distance in cells from the centre of each cell to the centre of the nearest cell
/// that is set; infinity when none is. Exact, O(cells) [Felzenszwalb and Huttenlocher 2012].
[[nodiscard]] std::vector<float> distance_to_cells(const std::vector<std::uint8_t>& cells,
                                                   const Raster& raster);

}  // namespace panonav::simulation
