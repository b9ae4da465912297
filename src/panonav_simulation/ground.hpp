#pragma once

#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav::simulation {

/// Heights of a ground that is not level, on a raster of square cells. The ground is a plane within
/// each cell. Cells without ground (below things, on steep slopes) get the height of the nearest
/// ground.
class Ground {
 public:
  /// Plane of the ground in a cell.
  struct Plane {
    float z_m = 0.0F;        ///< at the centre of the cell
    float slope_x = 0.0F;    ///< rise per metre in x
    float slope_y = 0.0F;    ///< rise per metre in y
    bool is_ground = false;  ///< false: the height of the nearest ground, level
  };

  /// Takes the planes row-major from `low`; z and slopes of planes that are no ground are replaced.
  /// Throws ContractError unless there are columns * rows planes, and one is ground.
  Ground(Point2 low, double cell_m, int columns, int rows, std::vector<Plane> planes);

  /// Returns the plane of the cell at `position`; beyond the raster that of the nearest cell, level
  /// and no ground.
  [[nodiscard]] Plane plane_at(Point2 position) const noexcept;
  /// Returns the height of the ground at `position` in the scene.
  [[nodiscard]] double height_m(Point2 position) const noexcept;
  /// Returns the lowest height of a cell's centre.
  [[nodiscard]] double lowest_m() const noexcept;
  /// Returns the highest height of a cell's centre.
  [[nodiscard]] double highest_m() const noexcept;
  /// Moves the ground up by `height_m`.
  void raise(double height_m) noexcept;

 private:
  struct Cell {
    Point2 centre;
    Plane plane;
  };
  [[nodiscard]] Cell cell_at(Point2 position) const noexcept;

  Point2 low_;
  double cell_m_;
  int columns_;
  int rows_;
  std::vector<Plane> planes_;
};

}  // namespace panonav::simulation
