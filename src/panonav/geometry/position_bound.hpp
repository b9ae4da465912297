#pragma once

#include <cmath>
#include <string_view>

namespace panonav {

/// Largest absolute coordinate of a position, in metres. Chosen as a quarter of a meridian: map
/// coordinates (UTM) fit, and doubles keep micrometre accuracy in sums and squares of them.
inline constexpr double max_position_m = 1e7;

/// Text of this range for error messages.
inline constexpr std::string_view position_range = "-10000000 to 10000000 m";

/// True if a coordinate, in metres, is a number within `max_position_m`.
[[nodiscard]] inline bool is_position(double coordinate_m) {
  return std::abs(coordinate_m) <= max_position_m;
}

}  // namespace panonav
