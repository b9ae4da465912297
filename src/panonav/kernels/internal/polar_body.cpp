#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

// The scalar body uses the library's arc tangent; the others are a loop without branches that the
// compiler vectorises.
template <Instructions set>
void PolarBody<set>::to_polar(const float* __restrict real, const float* __restrict imaginary,
                              float* __restrict magnitudes, float* __restrict phases_rad,
                              int count) {
  constexpr float pi = 3.14159265358979323846F;
  if constexpr (set == Instructions::scalar) {
    for (int i = 0; i < count; ++i) {
      const float phase = __builtin_atan2f(imaginary[i], real[i]);
      magnitudes[i] = __builtin_sqrtf(real[i] * real[i] + imaginary[i] * imaginary[i]);
      phases_rad[i] = magnitudes[i] > 0.0F ? (phase >= pi ? -pi : phase) : 0.0F;
    }
    return;
  }
  constexpr float tan_pi_8 = 0.41421356237309504880F;
  for (int i = 0; i < count; ++i) {
    const float x = real[i] < 0.0F ? -real[i] : real[i];
    const float y = imaginary[i] < 0.0F ? -imaginary[i] : imaginary[i];
    const float larger = x > y ? x : y;
    const float smaller = x > y ? y : x;
    const float magnitude = __builtin_sqrtf(x * x + y * y);
    // Reduces the angle to the nearer axis, 0 .. pi / 4; angles above pi / 8 are measured from pi /
    // 4, so that t is at most tan(pi / 8).
    const bool is_far = smaller > tan_pi_8 * larger;
    const float numerator = is_far ? smaller - larger : smaller;
    const float denominator = is_far ? smaller + larger : larger;
    const float t = numerator / (denominator > 0.0F ? denominator : 1.0F);
    // Chebyshev interpolation of (atan(t) / t - 1) / t^2 in t^2, over 0 .. tan(pi / 8)^2; error of
    // atan below 3e-8.
    const float z = t * t;
    const float series =
        -0.3333328656394374F +
        z * (0.19991237743069928F + z * (-0.14024142842264595F + z * 0.08520492037070682F));
    const float from_axis = (is_far ? pi / 4.0F : 0.0F) + (t + t * z * series);
    const float first = y > x ? pi / 2.0F - from_axis : from_axis;  // in the first quadrant
    const float upper = real[i] < 0.0F ? pi - first : first;
    const float signed_phase = imaginary[i] < 0.0F ? -upper : upper;
    const float phase = signed_phase >= pi ? -pi : signed_phase;
    magnitudes[i] = magnitude;
    phases_rad[i] = magnitude > 0.0F ? (phase < -pi ? -pi : phase) : 0.0F;
  }
}

template struct PolarBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
