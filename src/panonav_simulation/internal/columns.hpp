#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/ground.hpp"
#include "panonav_simulation/internal/occupancy.hpp"

namespace panonav::simulation {

/// Point where a vertical line crosses a triangle.
struct TrianglePoint {
  double z_m = 0.0;
  double slope_x = 0.0;   ///< rise of the triangle per metre in x
  double slope_y = 0.0;   ///< rise of the triangle per metre in y
  bool is_level = false;  ///< at most 30 degrees steep
  bool faces_up = false;  ///< by the order of its corners
};

/// Calls `visit(index, TrianglePoint)` for the centre of each cell that is within a triangle seen
/// from above; cells are numbered row-major.
template <class Visit>
void for_each_crossing(const Raster& raster, const Vector3& a, const Vector3& b, const Vector3& c,
                       const Visit& visit) {
  const double ux = b.x_m - a.x_m;
  const double uy = b.y_m - a.y_m;
  const double vx = c.x_m - a.x_m;
  const double vy = c.y_m - a.y_m;
  const double normal_z = ux * vy - uy * vx;
  if (normal_z == 0.0) return;
  const double uz = b.z_m - a.z_m;
  const double vz = c.z_m - a.z_m;
  const double normal_x = uy * vz - uz * vy;
  const double normal_y = uz * vx - ux * vz;
  constexpr double min_cosine = 0.866;  // 30 degrees
  const bool is_level = std::abs(normal_z) >= min_cosine * std::hypot(normal_x, normal_y, normal_z);
  const auto first_centre = [&](double from_m, int count) {
    return static_cast<int>(std::clamp(std::ceil(from_m / raster.cell_m - 0.5), 0.0, count + 0.0));
  };
  const auto last_centre = [&](double to_m, int count) {
    return static_cast<int>(std::clamp(std::floor(to_m / raster.cell_m - 0.5), -1.0, count - 1.0));
  };
  const auto [x_low, x_high] = std::minmax({a.x_m, b.x_m, c.x_m});
  const auto [y_low, y_high] = std::minmax({a.y_m, b.y_m, c.y_m});
  const int i_end = last_centre(x_high - raster.low.x_m, raster.columns);
  const int j_end = last_centre(y_high - raster.low.y_m, raster.rows);
  for (int j = first_centre(y_low - raster.low.y_m, raster.rows); j <= j_end; ++j) {
    for (int i = first_centre(x_low - raster.low.x_m, raster.columns); i <= i_end; ++i) {
      const double px = raster.low.x_m + (i + 0.5) * raster.cell_m - a.x_m;
      const double py = raster.low.y_m + (j + 0.5) * raster.cell_m - a.y_m;
      const double s = (px * vy - py * vx) / normal_z;
      const double t = (ux * py - uy * px) / normal_z;
      if (s < 0.0 || t < 0.0 || s + t > 1.0) continue;
      const std::size_t index =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(raster.columns) +
          static_cast<std::size_t>(i);
      visit(index, TrianglePoint{a.z_m + s * uz + t * vz, -normal_x / normal_z,
                                 -normal_y / normal_z, is_level, normal_z > 0.0});
    }
  }
}

/// Vertical lines on a raster of at most 250,000 columns over the floor area of a scene, and where
/// they cross its surfaces.
class Columns {
 public:
  /// With `may_be_room`, a closed surface around everything is a room, no solid.
  Columns(const Scene& scene, bool may_be_room);

  /// Returns the heights of the lowest surfaces with room for the robot above them, of each column
  /// whose neighbours at the robot's radius are as high: tops of walls are too narrow. Empty if
  /// these are less than a tenth of all columns: tops of a few things without ground.
  [[nodiscard]] std::vector<double> find_standing_heights(const FreeSpaceOptions& robot) const;

  /// Returns the ground if it is not level: the largest connected part of the lowest surfaces with
  /// room for the robot above them. Neighbouring columns are connected if their heights differ by
  /// at most a step more than their slopes explain. It counts as level, and as none below a tenth
  /// of all columns, if nine tenths of it are within a step of one height: a ramp in a hall is an
  /// obstacle. The result has cells of `cell_m`. Null if there is none.
  [[nodiscard]] std::shared_ptr<const Ground> find_sloping_ground(const Scene& scene,
                                                                  const FreeSpaceOptions& robot,
                                                                  double cell_m) const;

 private:
  struct Crossing {
    float z = 0.0F;
    std::uint32_t surface = 0;  // number among the scene's Solids
    float slope_x = 0.0F;
    float slope_y = 0.0F;
    bool is_level = false;
    bool faces_up = false;
  };

  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(raster_.columns) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] const Crossing* find_standing_surface(const std::vector<Crossing>& column,
                                                      double room_m) const;
  [[nodiscard]] std::vector<const Crossing*> find_largest_ground(
      const FreeSpaceOptions& robot) const;

  Raster raster_;
  std::vector<std::vector<Crossing>> crossings_;
  std::vector<bool> is_room_;  // of each surface; empty: none is
};

}  // namespace panonav::simulation
