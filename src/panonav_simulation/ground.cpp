#include "panonav_simulation/ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav::simulation {

Ground::Ground(Point2 low, double cell_m, int columns, int rows, std::vector<Plane> planes)
    : low_(low), cell_m_(cell_m), columns_(columns), rows_(rows), planes_(std::move(planes)) {
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  require(planes_.size() == count, "planes of a ground", static_cast<double>(planes_.size()),
          "columns * rows");
  // Spread the heights of the ground from cell to cell.
  std::vector<std::size_t> reached;
  std::vector<bool> is_reached(count, false);
  for (std::size_t k = 0; k < count; ++k) {
    is_reached[k] = planes_[k].is_ground;
    if (is_reached[k]) reached.push_back(k);
  }
  require(!reached.empty(), "cells with ground", 0.0, ">= 1");
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const int i = static_cast<int>(reached[next]) % columns;
    const int j = static_cast<int>(reached[next]) / columns;
    constexpr std::array<std::array<int, 2>, 4> steps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    for (const auto& [di, dj] : steps) {
      if (i + di < 0 || j + dj < 0 || i + di >= columns || j + dj >= rows) continue;
      const std::size_t k = static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(columns) +
                            static_cast<std::size_t>(i + di);
      if (is_reached[k]) continue;
      is_reached[k] = true;
      planes_[k] = {.z_m = planes_[reached[next]].z_m};
      reached.push_back(k);
    }
  }
}

Ground::Cell Ground::cell_at(Point2 position) const noexcept {
  const double x = std::floor((position.x_m - low_.x_m) / cell_m_);
  const double y = std::floor((position.y_m - low_.y_m) / cell_m_);
  // The comparison is false for NaN, too.
  const double i = x > 0.0 ? std::min(x, columns_ - 1.0) : 0.0;
  const double j = y > 0.0 ? std::min(y, rows_ - 1.0) : 0.0;
  const Point2 centre{low_.x_m + (i + 0.5) * cell_m_, low_.y_m + (j + 0.5) * cell_m_};
  const Plane& plane = planes_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                               static_cast<std::size_t>(i)];
  if (i == x && j == y) return {centre, plane};
  return {centre, {.z_m = plane.z_m}};
}

Ground::Plane Ground::plane_at(Point2 position) const noexcept {
  return cell_at(position).plane;
}

double Ground::height_m(Point2 position) const noexcept {
  const auto [centre, plane] = cell_at(position);
  if (!plane.is_ground) return plane.z_m;
  return plane.z_m + plane.slope_x * (position.x_m - centre.x_m) +
         plane.slope_y * (position.y_m - centre.y_m);
}

double Ground::lowest_m() const noexcept {
  return std::ranges::min_element(planes_, {}, &Plane::z_m)->z_m;
}

double Ground::highest_m() const noexcept {
  return std::ranges::max_element(planes_, {}, &Plane::z_m)->z_m;
}

void Ground::raise(double height_m) noexcept {
  for (Plane& plane : planes_) plane.z_m += static_cast<float>(height_m);
}

}  // namespace panonav::simulation
