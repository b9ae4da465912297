#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <span>

namespace panonav {

/// The same angle in [-pi, pi). NaN and infinities give NaN.
[[nodiscard]] double wrap_angle_far(double angle_rad);
/// The same angle in [-pi, pi), fast where it lies there already. NaN and infinities give NaN.
[[nodiscard]] inline double wrap_angle(double angle_rad) {
  // Most angles are already there, and the remainder is slow.
  if (angle_rad >= -std::numbers::pi && angle_rad < std::numbers::pi) return angle_rad;
  return wrap_angle_far(angle_rad);
}

/// The smallest turn from `from_rad` to `to_rad`, in [-pi, pi).
[[nodiscard]] double angle_difference(double to_rad, double from_rad);

/// An angle of degrees in radians, not wrapped.
[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * 0.017453292519943295;
}
/// An angle of radians in degrees, not wrapped.
[[nodiscard]] constexpr double degrees(double radians) {
  return radians * 57.29577951308232;
}

/// The angle in degrees as files show it: 30 rather than 29.999999999999996 where both are read
/// back as the same radians.
[[nodiscard]] inline double round_trip_degrees(double angle_rad) {
  const double exact = degrees(angle_rad);
  constexpr double steps = 1e9;
  const double rounded = std::round(exact * steps) / steps;
  return radians(rounded) == angle_rad ? rounded : exact;
}

/// Mean direction of angles, and how well they agree.
struct CircularMean {
  double direction_rad = 0.0;     ///< in [-pi, pi)
  double resultant_length = 0.0;  ///< 0 (no common direction) .. 1 (all the same)
};

/// Empty when there are no angles or when they cancel, so that no direction is meant.
[[nodiscard]] std::optional<CircularMean> circular_mean(std::span<const double> angles_rad);

/// sqrt(-2 ln r), r the resultant length of the mean; in radians.
[[nodiscard]] double circular_standard_deviation(const CircularMean& mean);

}  // namespace panonav
