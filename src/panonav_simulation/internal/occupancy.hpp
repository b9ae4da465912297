#pragma once

#include <cstdint>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A raster over the floor plane: cell (i, j) covers [low + (i, j) cell, low + (i + 1, j + 1)
/// cell].
struct Raster {
  Point2 low;
  double cell_m = 0.025;
  int columns = 0;
  int rows = 0;
};

/// Returns 1 for every cell over which a triangle of the scene has a point at a height in low_z_m
/// .. high_z_m, row-major; also for cells that a triangle only touches.
[[nodiscard]] std::vector<std::uint8_t> find_occupied_cells(const Scene& scene,
                                                            const Raster& raster, double low_z_m,
                                                            double high_z_m);

/// Returns 1 for every cell over which a triangle of the scene has a point at a height in low_m ..
/// high_m above the ground, row-major. Cells count as wholly covered by triangles at most 45
/// degrees steep that they touch.
[[nodiscard]] std::vector<std::uint8_t> find_cells_above_ground(const Scene& scene,
                                                                const Raster& raster,
                                                                const Ground& ground, double low_m,
                                                                double high_m);

/// Returns the distance, in cells, from the centre of each cell to the centre of the nearest
/// nonzero cell; infinity if there is none. Exact, O(cells) [Felzenszwalb and Huttenlocher 2012].
[[nodiscard]] std::vector<float> compute_distances_to_cells(const std::vector<std::uint8_t>& cells,
                                                            const Raster& raster);

}  // namespace panonav::simulation
