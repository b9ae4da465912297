#pragma once

// The body of explain_likeness: loops without branches, which the compiler vectorises for each
// instruction set. In an unnamed namespace, so that each has a copy of its own.

#include "panonav/kernels/likeness_targets.hpp"

namespace panonav::kernels {
namespace {

// Adding it rounds to whole numbers: 1.5 * 2^23.
constexpr float rounder = 12582912.0F;

// exp(x) for x <= 0; relative error below 4e-6.
inline float exp_of_negative(float x) {
  const float product = x * 1.44269504088896F;
  const float y = product > -126.0F ? product : -126.0F;
  const float whole = (y + rounder) - rounder;
  const float f = (y - whole) * 0.693147180559945F;
  const float series =
      1.0F + f * (1.0F + f * (0.5F + f * (1.0F / 6 + f * (1.0F / 24 + f * (1.0F / 120)))));
  const int exponent = (static_cast<int>(whole) + 127) << 23;
  float power;
  __builtin_memcpy(&power, &exponent, sizeof power);
  return series * power;
}

inline float wrapped(float angle_rad) {
  constexpr float turn_rad = 6.28318530717959F;
  const float turns = (angle_rad * (1.0F / turn_rad) + rounder) - rounder;
  return angle_rad - turn_rad * turns;
}

inline void explain_likeness_loop(const LikenessLanes& lanes, const LikenessFall& fall,
                                  const float* __restrict x_m, const float* __restrict y_m,
                                  const float* __restrict heading_rad, float* __restrict explained,
                                  int count) {
  for (int p = 0; p < count; ++p) {
    float squares[likeness_lanes];
    float products[likeness_lanes];
    for (int i = 0; i < likeness_lanes; ++i) {
      const float dx = lanes.x_m[i] - x_m[p];
      const float dy = lanes.y_m[i] - y_m[p];
      const float turn = wrapped(heading_rad[p] - lanes.heading_rad[i]);
      const float other_turn = wrapped(heading_rad[p] - lanes.other_heading_rad[i]);
      const float apart = __builtin_sqrtf(dx * dx + dy * dy + fall.blur_square_m2);
      const float expected = exp_of_negative(-apart * fall.per_metre);
      const float facing =
          lanes.likeness[i] * exp_of_negative(turn * turn * lanes.per_square_turn[i]);
      const float other = lanes.other_likeness[i] *
                          exp_of_negative(other_turn * other_turn * lanes.per_square_turn[i]);
      squares[i] = expected * expected;
      products[i] = (facing > other ? facing : other) * expected;
    }
    // Sums in one order, whatever the width of vectors.
    for (int half = likeness_lanes / 2; half > 0; half /= 2) {
      for (int i = 0; i < half; ++i) {
        squares[i] += squares[i + half];
        products[i] += products[i + half];
      }
    }
    explained[p] = products[0] * products[0] / (squares[0] + 1e-30F);
  }
}

}  // namespace
}  // namespace panonav::kernels
