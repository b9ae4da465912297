#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>

#include "panonav/geometry/point_grid.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Arrangement of the reference views around a position. It decides what can be known of the
/// position: views along a line give no evidence of the distance from the line.
struct LocalLayout {
  /// Kinds of arrangements.
  enum class Kind {
    area,  ///< the views cover an area, with neighbours on all sides of the position
    edge,  ///< the views cover an area, which ends at the position
    line,  ///< the views form a straight or gently curved line, such as a drive
    other  ///< none of these, such as a sharp bend of a drive or a few scattered views
  };
  Kind kind = Kind::other;     ///< kind of the arrangement
  double direction_rad = 0.0;  ///< of the line, in [-pi/2, pi/2]; 0 for other kinds
};

/// The positions of all posed views, to find how they are arranged around a position.
class ReferenceLayout {
 public:
  /// `spacing_m`: of the posed views; if 0, all layouts are `other`.
  ReferenceLayout(const VisualMemory& memory, double spacing_m);

  /// Returns the largest distance at which a view matters.
  [[nodiscard]] static double reach_m(double spacing_m) noexcept;
  /// Returns the layout around a view's position, without the views `excluded`. Cost: a few
  /// microseconds.
  [[nodiscard]] LocalLayout around(const FloorPosition& there,
                                   std::span<const ViewId> excluded = {}) const;

 private:
  double spacing_m_;
  std::map<std::string, PointGrid, std::less<>> grids_;  // of the views' ids, by floor
};

}  // namespace panonav
