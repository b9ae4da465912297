#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

/// Elementary functions with the same bits on every processor and with every C library: only
/// additions, multiplications, divisions and square roots of IEEE 754, so the compiler must not
/// fuse them (-ffp-contract=off). Homing and chains of snapshots use them, so that a
/// microcontroller decides as the computer does on which a route was recorded. Results are within 2
/// units in the last place. Cost: about 30 operations.
namespace panonav::portable {

/// Cosine and sine of one angle.
struct CosineSine {
  double cosine = 1.0;  ///< from -1 to 1
  double sine = 0.0;    ///< from -1 to 1
};

/// Computes the cosine and the sine of an angle in radians, |angle| < 1e6; NaN beyond.
[[nodiscard]] constexpr CosineSine cosine_sine(double angle_rad) noexcept {
  constexpr double max_angle_rad = 1e6;
  if (!(angle_rad > -max_angle_rad && angle_rad < max_angle_rad)) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  // pi / 2 in two parts: products of the first one, of 33 bits, with a quadrant are exact.
  constexpr double quadrant_high = 1.57079632673412561417;
  constexpr double quadrant_low = 6.07710050650619224932e-11;
  constexpr double quadrants_per_rad = 0.636619772367581343;
  const double turns = angle_rad * quadrants_per_rad;
  const auto quadrant = static_cast<std::int32_t>(turns < 0.0 ? turns - 0.5 : turns + 0.5);
  const double r = (angle_rad - quadrant * quadrant_high) - quadrant * quadrant_low;
  // Taylor series up to r^17; |r| <= pi / 4.
  const double q = r * r;
  double sine = 0.0;
  for (int n = 16; n >= 2; n -= 2) sine = (1.0 + sine) * (-q / (n * (n + 1)));
  double cosine = 0.0;
  for (int n = 18; n >= 4; n -= 2) cosine = (1.0 + cosine) * (-q / (n * (n - 1)));
  sine = r + r * sine;
  cosine = 1.0 + (-0.5 * q + -0.5 * q * cosine);
  switch (static_cast<unsigned>(quadrant) & 3U) {
    case 0:
      return {cosine, sine};
    case 1:
      return {-sine, cosine};
    case 2:
      return {-cosine, -sine};
    default:
      return {sine, -cosine};
  }
}

/// Computes the sine of an angle; domain as `cosine_sine`.
[[nodiscard]] constexpr double sin(double angle_rad) noexcept {
  return cosine_sine(angle_rad).sine;
}
/// Computes the cosine of an angle; domain as `cosine_sine`.
[[nodiscard]] constexpr double cos(double angle_rad) noexcept {
  return cosine_sine(angle_rad).cosine;
}

/// Computes the arc tangent of a ratio from 0 to 1; NaN gives NaN.
[[nodiscard]] constexpr double atan_of_ratio(double ratio) noexcept {
  // Arc tangents of 0, 1/8 .. 1.
  constexpr double table[] = {
      0.0,
      0.12435499454676143503,
      0.24497866312686415417,
      0.35877067027057222040,
      0.46364760900080611621,
      0.55859931534356243597,
      0.64350110879328438680,
      0.71882999962162450542,
      0.78539816339744830962,
  };
  constexpr double steps = 8.0;
  if (!(ratio >= 0.0 && ratio <= 1.0)) return std::numeric_limits<double>::quiet_NaN();
  const auto i = static_cast<std::size_t>(ratio * steps + 0.5);
  const double c = static_cast<double>(i) / steps;
  const double z = (ratio - c) / (1.0 + ratio * c);  // at most 1 / 16
  const double q = z * z;
  double series = 0.0;
  for (int n = 13; n >= 3; n -= 2) series = -q * (1.0 / n + series);
  return table[i] + (z + z * series);
}

/// Computes the angle of a point, in [-pi, pi]; that of (0, 0) is 0, or pi if x is -0.
[[nodiscard]] inline double atan2(double y, double x) noexcept {
  constexpr double pi = 3.14159265358979323846;
  const double ax = std::abs(x);
  const double ay = std::abs(y);
  double angle_rad = 0.0;
  if (ax > 0.0 || ay > 0.0 || ax != ax || ay != ay) {
    angle_rad = ay <= ax ? atan_of_ratio(ay / ax) : 0.5 * pi - atan_of_ratio(ax / ay);
  }
  if (std::signbit(x)) angle_rad = pi - angle_rad;
  return std::copysign(angle_rad, y);
}

/// Computes the arc sine of a number from -1 to 1; NaN beyond.
[[nodiscard]] inline double asin(double sine) noexcept {
  return portable::atan2(sine, std::sqrt((1.0 - sine) * (1.0 + sine)));
}

/// Computes the length of a vector. Its square must neither overflow nor underflow.
[[nodiscard]] inline double hypot(double x, double y) noexcept {
  return std::sqrt(x * x + y * y);
}

/// Returns 2 to an integer from -1022 to 1023.
[[nodiscard]] constexpr double power_of_two(int exponent) noexcept {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52U);
}

/// Computes e^x; 0 below -700, infinity above 700.
[[nodiscard]] constexpr double exp(double x) noexcept {
  constexpr double max_exponent = 700.0;
  if (x > max_exponent) return std::numeric_limits<double>::infinity();
  if (x < -max_exponent) return 0.0;
  if (x != x) return x;
  // ln 2 in two parts: products of the first one with an exponent are exact.
  constexpr double ln2_high = 6.93147180369123816490e-01;
  constexpr double ln2_low = 1.90821492927058770002e-10;
  constexpr double inverse_ln2 = 1.44269504088896338700;
  const double octaves = x * inverse_ln2;
  const auto n = static_cast<int>(octaves < 0.0 ? octaves - 0.5 : octaves + 0.5);
  const double r = (x - n * ln2_high) - n * ln2_low;
  double series = 0.0;  // Taylor up to r^14; |r| <= 0.35
  for (int i = 14; i >= 2; --i) series = r / i * (1.0 + series);
  return (1.0 + (r + r * series)) * power_of_two(n);
}

/// Computes the natural logarithm; minus infinity for 0, NaN below.
[[nodiscard]] constexpr double log(double x) noexcept {
  if (!(x > 0.0)) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    return x == 0.0 ? -infinity : std::numeric_limits<double>::quiet_NaN();
  }
  if (x > std::numeric_limits<double>::max()) return x;
  constexpr double sqrt2 = 1.41421356237309504880;
  int octave = 0;
  if (x < std::numeric_limits<double>::min()) {
    constexpr int shift = 54;  // makes it normal
    x *= power_of_two(shift);
    octave = -shift;
  }
  const auto bits = std::bit_cast<std::uint64_t>(x);
  octave += static_cast<int>(bits >> 52U) - 1023;
  double mantissa =
      std::bit_cast<double>((bits & 0x000FFFFFFFFFFFFFU) | 0x3FF0000000000000U);  // 1 .. 2
  if (mantissa > sqrt2) {
    mantissa *= 0.5;
    ++octave;
  }
  // ln m = 2 artanh((m - 1) / (m + 1)), by its series; the argument is at most 0.172.
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  const double q = s * s;
  double series = 0.0;
  for (int n = 21; n >= 3; n -= 2) series = q * (1.0 / n + series);
  constexpr double ln2_high = 6.93147180369123816490e-01;
  constexpr double ln2_low = 1.90821492927058770002e-10;
  return octave * ln2_high + (2.0 * s + (2.0 * s * series + octave * ln2_low));
}

}  // namespace panonav::portable
