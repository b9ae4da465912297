#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// A grid of views in the middle of a scene, along a zigzag as in [M04] figure 16.
struct ViewGrid {
  int columns = 0;  ///< along x
  int rows = 0;     ///< along y
  double spacing_m = 0.3;
  std::vector<Pose2> poses;
  VisualMemory memory;
};

enum class GridHeadings { random, along_path };

/// Records the views. `place` needs no references.
[[nodiscard]] ViewGrid record_grid(const simulation::PlaceRecording& place, int columns, int rows,
                                   double spacing_m, GridHeadings headings, Executor& executor);

/// Makes an empty room of 4 x 3.5 m with pictures, windows and a door on its walls.
[[nodiscard]] simulation::Scene make_small_room(std::uint64_t seed);

/// Simulates coarse odometry along the path: uniform errors of up to `distance_share` of the
/// distance and `direction_share` of half a turn in direction and heading [M04 section 3.4].
[[nodiscard]] std::vector<CoarseMotion> simulate_coarse_motion(const ViewGrid& grid,
                                                               double distance_share,
                                                               double direction_share,
                                                               std::uint64_t seed);

/// Comparison of an arrangement with the true grid.
struct GridComparison {
  double shape_difference = 1.0;  ///< as arranged, without a mirror image
  double with_reflection = 1.0;   ///< the same when a mirror image is allowed
  double four_of_eight = 0.0;     ///< share of inner views with all grid neighbours among eight
  double border_pull = 0.0;       ///< how far border views lie inwards, in spacings, mean
  std::vector<Point2> aligned;    ///< arranged positions laid over the true ones
};
/// Compares positions with the true grid. Views outside the largest component count as wrong.
[[nodiscard]] GridComparison compare_with_grid(const ViewGrid& grid, const Lattice& lattice);

/// Returns the errors of the turns that phases give between views one spacing apart, rad.
[[nodiscard]] std::vector<double> turn_errors(const ViewGrid& grid, const Lattice& lattice);

/// Returns the lines between neighbours of the grid, for images.
[[nodiscard]] std::vector<std::vector<Point2>> grid_lines(const ViewGrid& grid,
                                                          std::span<const Point2> positions);

}  // namespace panonav::lab
