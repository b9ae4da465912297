#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Stores numbered points in square grid cells, for fast search near a position.
class PointGrid {
 public:
  /// `cell_m`: side of a cell, > 0.
  explicit PointGrid(double cell_m) : cell_m_(cell_m) {}

  /// Adds a point.
  void add(std::uint32_t number, Point2 position) {
    cells_[key(cell(position.x_m), cell(position.y_m))].push_back({number, position});
  }
  /// Calls visit(number, position) for all points in the cell of the position and in its 8
  /// neighbours, which include all points within one cell side. Within a cell, points are visited
  /// in the order in which they were added.
  template <class Visit>
  void visit_near(Point2 position, const Visit& visit) const {
    const std::int64_t x = cell(position.x_m);
    const std::int64_t y = cell(position.y_m);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto found = cells_.find(key(x + dx, y + dy));
        if (found == cells_.end()) continue;
        for (const Entry& entry : found->second) visit(entry.number, entry.position);
      }
    }
  }

 private:
  struct Entry {
    std::uint32_t number;
    Point2 position;
  };
  /// Returns the cell index of a coordinate; it wraps at 1e9 cells, so that distant cells may share
  /// a key.
  [[nodiscard]] std::int64_t cell(double value_m) const {
    return static_cast<std::int64_t>(std::floor(std::fmod(value_m / cell_m_, 1e9)));
  }
  [[nodiscard]] static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32U) ^ (static_cast<std::uint64_t>(y) & 0xFFFFFFFFU);
  }

  double cell_m_;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
};

}  // namespace panonav
