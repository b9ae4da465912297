#pragma once

#include <cmath>

#include "panonav/geometry/angles.hpp"

namespace panonav {

/// The angle in degrees as files show it: 30 rather than 29.999999999999996 where both are read
/// back as the same radians.
[[nodiscard]] inline double written_degrees(double angle_rad) {
  const double exact = degrees(angle_rad);
  constexpr double steps = 1e9;
  const double rounded = std::round(exact * steps) / steps;
  return radians(rounded) == angle_rad ? rounded : exact;
}

}  // namespace panonav
