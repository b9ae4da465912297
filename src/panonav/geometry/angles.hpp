#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <span>

namespace panonav {

/// Wraps any angle to [-pi, pi). NaN and infinities give NaN.
[[nodiscard]] double wrap_angle_by_remainder(double angle_rad);
/// Wraps an angle to [-pi, pi); fast for angles already within. NaN and infinities give NaN.
[[nodiscard]] inline double wrap_angle(double angle_rad) {
  // Avoids the slow remainder for angles that are already wrapped, which most are.
  if (angle_rad >= -std::numbers::pi && angle_rad < std::numbers::pi) return angle_rad;
  return wrap_angle_by_remainder(angle_rad);
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

/// Converts to degrees for text files: rounds to 1e-9 degrees if this converts back to exactly the
/// same radians (30 instead of 29.999999999999996).
[[nodiscard]] inline double to_exact_degrees(double angle_rad) {
  const double exact = degrees(angle_rad);
  constexpr double steps = 1e9;
  const double rounded = std::round(exact * steps) / steps;
  return radians(rounded) == angle_rad ? rounded : exact;
}

/// Mean direction of angles, with the resultant length as measure of their concentration.
struct CircularMean {
  double direction_rad = 0.0;     ///< in [-pi, pi)
  double resultant_length = 0.0;  ///< 0 (no common direction) .. 1 (all the same)
};

/// Computes the mean direction; nullopt when there are no angles or when they cancel.
[[nodiscard]] std::optional<CircularMean> circular_mean(std::span<const double> angles_rad);

/// Computes the circular standard deviation sqrt(-2 ln r) in radians, where r is the resultant
/// length.
[[nodiscard]] double circular_standard_deviation(const CircularMean& mean);

}  // namespace panonav
