#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Views on a grid in the middle of a scene, taken along a zigzag as in [M04] figure 16.
struct ViewGrid {
  int columns = 0;  ///< along x
  int rows = 0;     ///< along y
  double spacing_m = 0.3;
  std::vector<Pose2> poses;
  VisualMemory memory;
};

enum class GridHeadings { random, along_path };

/// Records the views of a grid. `place` needs no references.
[[nodiscard]] ViewGrid record_grid(const simulation::PlaceRecording& place, int columns, int rows,
                                   double spacing_m, GridHeadings headings, Executor& executor);

/// Makes an empty room of 4 x 3.5 m with pictures, windows and a door on its walls.
[[nodiscard]] simulation::Scene make_small_room(std::uint64_t seed);

/// Simulates coarse odometry along the path with uniform errors: up to `distance_share` of the
/// distance, and up to `direction_share` of half a turn in direction and in heading [M04 section
/// 3.4].
[[nodiscard]] std::vector<CoarseMotion> simulate_coarse_motion(const ViewGrid& grid,
                                                               double distance_share,
                                                               double direction_share,
                                                               std::uint64_t seed);

/// Errors of an arrangement compared with the true grid.
struct GridComparison {
  double shape_difference = 1.0;  ///< without allowing reflection
  double with_reflection = 1.0;   ///< when reflection is allowed
  double four_of_eight = 0.0;     ///< share of inner views with all 4 neighbours in their 8 nearest
  double border_pull = 0.0;       ///< mean inward shift of border views, in spacings
  std::vector<Point2> aligned;    ///< arranged positions aligned to the true ones
};
/// Compares arranged positions with the true grid. Views outside the largest component are placed
/// at the origin, which makes them errors.
[[nodiscard]] GridComparison compare_with_grid(const ViewGrid& grid, const Lattice& lattice);

/// Returns the errors, in rad, of the rotations estimated by phases between views one spacing
/// apart.
[[nodiscard]] std::vector<double> turn_errors(const ViewGrid& grid, const Lattice& lattice);

/// Returns the grid lines as polylines through neighbouring positions, for plots.
[[nodiscard]] std::vector<std::vector<Point2>> grid_lines(const ViewGrid& grid,
                                                          std::span<const Point2> positions);

}  // namespace panonav::lab
