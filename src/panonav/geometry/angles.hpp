#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <span>

namespace panonav {

/// Wraps any angle to [-pi, pi). NaN and infinities give NaN.
[[nodiscard]] double wrap_angle_far(double angle_rad);
/// Wraps an angle to [-pi, pi); fast for angles already within. NaN and infinities give NaN.
[[nodiscard]] inline double wrap_angle(double angle_rad) {
  // Most angles are already there, and the remainder is slow.
  if (angle_rad >= -std::numbers::pi && angle_rad < std::numbers::pi) return angle_rad;
  return wrap_angle_far(angle_rad);
}

/// The smallest rotation from `from_rad` to `to_rad`, in [-pi, pi).
[[nodiscard]] double angle_difference(double to_rad, double from_rad);

/// Converts degrees to radians, not wrapped.
[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * 0.017453292519943295;
}
/// Converts radians to degrees, not wrapped.
[[nodiscard]] constexpr double degrees(double radians) {
  return radians * 57.29577951308232;
}

/// Converts to degrees as files show them: 30 rather than 29.999999999999996 where both are read
/// back as the same radians.
[[nodiscard]] inline double to_exact_degrees(double angle_rad) {
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

/// Computes the mean direction; nullopt when there are no angles or when they cancel.
[[nodiscard]] std::optional<CircularMean> circular_mean(std::span<const double> angles_rad);

/// Standard deviation sqrt(-2 ln r) in radians, r the resultant length of the mean.
[[nodiscard]] double circular_standard_deviation(const CircularMean& mean);

}  // namespace panonav
