#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Size of a robot, and the height of the steps that it can drive over.
struct FreeSpaceOptions {
  double robot_radius_m = 0.2;  ///< >= 0; the robot is modelled as a cylinder
  double robot_height_m = 0.6;  ///< surfaces between step and robot height are obstacles
  double step_height_m = 0.05;  ///< lower things (carpet, sill) can be driven over
  double floor_height_m = 0.0;  ///< z of the floor
  double cell_m = 0.025;        ///< of the map
};
void visit_options(FreeSpaceOptions& options, OptionVisitor& visitor);

/// Returns the options of a robot with this radius that is as high as its camera and drives over
/// steps of a twelfth of this height.
[[nodiscard]] FreeSpaceOptions free_space_options(double robot_radius_m, double camera_height_m);

/// Returns the options of the robot for which a scene is made.
[[nodiscard]] FreeSpaceOptions free_space_options(const Scene& scene);

/// The free space of a robot in a scene: positions inside `floor_low .. floor_high` and the
/// `drivable` areas, if any; with a surface to stand on within the step height of the floor, unless
/// the scene has no floor at all; and without a surface between step height and robot height within
/// the robot's radius. On the scene's ground, if it has one, these heights are measured from it.
/// Only one connected component is kept: the one with `seed`; without it the largest inside of the
/// fewest solids (a table is one).
///
/// Computed on a map of square cells. Distances to obstacles are never overestimated and
/// underestimated by at most 1.5 cells. Building costs O(cells + triangle area).
class FreeSpace {
 public:
  /// Throws OptionError on options out of range, and ContractError if the scene is not valid, its
  /// floor is larger than 100 million cells, nothing is free, or `seed` is not free.
  explicit FreeSpace(const Scene& scene, const FreeSpaceOptions& options = {},
                     std::optional<Point2> seed = std::nullopt);

  /// True if the centre of the robot can be at `position`; false outside the map.
  [[nodiscard]] bool is_free(Point2 position) const noexcept;
  /// Returns a lower bound of the distance from `position` to the nearest obstacle; 0 outside the
  /// map.
  [[nodiscard]] double clearance_m(Point2 position) const noexcept;
  /// True if the whole straight line from `a` to `b` is free.
  [[nodiscard]] bool is_free_between(Point2 a, Point2 b) const noexcept;

  [[nodiscard]] double area_m2() const noexcept;  ///< of all free cells
  /// True if the free positions are inside of a solid, because nothing outside is free.
  [[nodiscard]] bool is_inside_solid() const noexcept { return is_inside_solid_; }
  /// Returns the largest slope of the scene's ground at a free position; 0 without a ground.
  [[nodiscard]] double max_slope_rad() const noexcept { return max_slope_rad_; }
  /// Returns the radius of the robot for which the free space is computed.
  [[nodiscard]] double robot_radius_m() const noexcept { return robot_radius_m_; }
  /// Returns the lower left corner of the map: that of the scene's floor.
  [[nodiscard]] Point2 low() const noexcept { return low_; }
  /// Returns the upper right corner of the map: that of the scene's floor.
  [[nodiscard]] Point2 high() const noexcept { return high_; }

  /// Returns the free positions of a regular grid over the floor.
  [[nodiscard]] std::vector<GridPosition> grid(double spacing_m,
                                               GridOrder order = GridOrder::raster) const;
  /// Draws a pose uniformly over the free area, with a uniform heading.
  [[nodiscard]] Pose2 random_pose(Random& random) const;
  /// Returns a short path through free positions as way points, from `a` to `b`; nullopt if one of
  /// these is not free. Shortest on the 8-connected cells, then shortened by straight lines.
  /// O(cells log cells).
  [[nodiscard]] std::optional<std::vector<Point2>> shortest_path(Point2 a, Point2 b) const;

  /// Draws a map with one pixel per cell, y upwards: free cells white, cells too near to obstacles
  /// grey, obstacles black, all others dark grey.
  [[nodiscard]] Image picture() const;

 private:
  struct Cell {
    int i = 0;
    int j = 0;
  };
  [[nodiscard]] std::optional<Cell> cell_at(Point2 position) const noexcept;
  [[nodiscard]] std::size_t index(Cell cell) const noexcept {
    return static_cast<std::size_t>(cell.j) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(cell.i);
  }
  [[nodiscard]] Point2 centre(Cell cell) const noexcept;
  [[nodiscard]] std::vector<Point2> shorten_path(std::vector<Point2> path) const;
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> find_connected_components() const;
  void keep_connected_component(const Scene& scene, double z_m, std::optional<Point2> seed);

  Point2 low_, high_;
  double cell_m_;
  double robot_radius_m_;
  int columns_ = 0;
  int rows_ = 0;
  bool is_inside_solid_ = false;
  double max_slope_rad_ = 0.0;
  std::vector<std::uint8_t> obstacle_;
  std::vector<std::uint8_t> free_;
  std::vector<float> clearance_m_;
  std::vector<std::uint32_t> free_cells_;  // indices, ascending
};

}  // namespace panonav::simulation
