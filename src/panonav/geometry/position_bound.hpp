#pragma once

#include <cmath>
#include <string_view>

namespace panonav {

/// Largest coordinate of a position, in metres either way: a quarter of a meridian, so that the
/// coordinates of maps (UTM) fit, while squares and sums of them keep micrometres in a double.
/// Chosen.
inline constexpr double max_position_m = 1e7;

/// The same for messages.
inline constexpr std::string_view position_range = "-10000000 to 10000000 m";

/// True if a coordinate, in metres, is a number within `max_position_m`.
[[nodiscard]] inline bool is_position(double coordinate_m) {
  return std::abs(coordinate_m) <= max_position_m;
}

}  // namespace panonav
