#include "panonav/kernels/internal/bodies.hpp"

// Loops without branches, which the compiler vectorises for each instruction set.

namespace panonav::kernels {
namespace {

// Approximates ln x for 2^-33 <= x <= 1; error below 1e-7 relative plus 1e-7 absolute.
inline float approximate_log(float x) {
  int bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  // Normalises the mantissa to sqrt(1/2) .. sqrt(2), so that numbers near 1 have exponent 0.
  const int shifted = bits - 0x3F3504F3;
  const int exponent = shifted >> 23;
  const int mantissa_bits = (shifted & 0x007FFFFF) + 0x3F3504F3;
  float mantissa;
  __builtin_memcpy(&mantissa, &mantissa_bits, sizeof mantissa);
  // ln m = 2 artanh t.
  const float t = (mantissa - 1.0F) / (mantissa + 1.0F);
  const float z = t * t;
  const float series = 2.0F + z * (2.0F / 3 + z * (2.0F / 5 + z * (2.0F / 7 + z * (2.0F / 9))));
  return static_cast<float>(exponent) * 0.693147180559945F + t * series;
}

}  // namespace

// Box-Muller, as Random::normal_pair.
template <Instructions set>
void MotionBody<set>::normal_pairs(const uint64_t* __restrict bits, float* __restrict first,
                                   float* __restrict second, int count) {
  constexpr float rounder = 12582912.0F;  // 1.5 * 2^23: adding it rounds to an integer
  for (int i = 0; i < count; ++i) {
    const auto radius_bits = static_cast<unsigned int>(bits[i] >> 32U);
    const auto angle_bits = static_cast<unsigned int>(bits[i]);
    const float share = (static_cast<float>(radius_bits) + 0.5F) * 0x1.0p-32F;
    const float radius_share = share < 1.0F ? share : 1.0F;
    const float quarters = (static_cast<float>(angle_bits) + 0.5F) * 0x1.0p-30F;
    const float radius = __builtin_sqrtf(-2.0F * approximate_log(radius_share));
    const float rounded = quarters + rounder;
    int quarter;
    __builtin_memcpy(&quarter, &rounded, sizeof quarter);
    const float angle = (quarters - (rounded - rounder)) * 1.57079632679489662F;
    // Taylor, over -pi / 4 .. pi / 4.
    const float z = angle * angle;
    const float sine =
        angle * (1.0F - z * (1.0F / 6 - z * (1.0F / 120 - z * (1.0F / 5040 - z / 362880.0F))));
    const float cosine =
        1.0F - z * (0.5F - z * (1.0F / 24 - z * (1.0F / 720 - z * (1.0F / 40320))));
    const bool across = (quarter & 1) != 0;
    const float x = across ? sine : cosine;
    const float y = across ? cosine : sine;
    first[i] = ((quarter + 1) & 2) != 0 ? -radius * x : radius * x;
    second[i] = (quarter & 2) != 0 ? -radius * y : radius * y;
  }
}

template <Instructions set>
void MotionBody<set>::move_poses(double* __restrict x_m, double* __restrict y_m,
                                 double* __restrict heading_rad, const double* __restrict forward_m,
                                 const double* __restrict left_m,
                                 const double* __restrict turn_error_rad, double turn_rad,
                                 double turn_share_before_travel, int count) {
  constexpr double rounder = 6755399441055744.0;  // 1.5 * 2^52
  for (int i = 0; i < count; ++i) {
    const double direction = heading_rad[i] + turn_share_before_travel * turn_error_rad[i];
    const double rounded = direction * 0.636619772367581343 + rounder;  // in quarters of a turn
    long long quarter;
    __builtin_memcpy(&quarter, &rounded, sizeof quarter);
    const double quarters = rounded - rounder;
    // Subtracts multiples of pi / 2 in two parts; the first part has trailing zero bits, so that
    // its product is exact.
    const double angle =
        (direction - quarters * 1.57079632673412561) - quarters * 6.07710050650619225e-11;
    // Taylor, over -pi / 4 .. pi / 4; error below 1e-12.
    const double z = angle * angle;
    const double sine =
        angle *
        (1.0 - z * (1.0 / 6 -
                    z * (1.0 / 120 -
                         z * (1.0 / 5040 - z * (1.0 / 362880 -
                                                z * (1.0 / 39916800 - z * (1.0 / 6227020800)))))));
    const double cosine =
        1.0 - z * (0.5 - z * (1.0 / 24 -
                              z * (1.0 / 720 - z * (1.0 / 40320 -
                                                    z * (1.0 / 3628800 - z * (1.0 / 479001600))))));
    const bool across = (quarter & 1) != 0;
    const double c = across ? sine : cosine;
    const double s = across ? cosine : sine;
    const double cos_direction = ((quarter + 1) & 2) != 0 ? -c : c;
    const double sin_direction = (quarter & 2) != 0 ? -s : s;
    x_m[i] += cos_direction * forward_m[i] - sin_direction * left_m[i];
    y_m[i] += sin_direction * forward_m[i] + cos_direction * left_m[i];
    heading_rad[i] += turn_rad + turn_error_rad[i];
  }
}

template struct MotionBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
