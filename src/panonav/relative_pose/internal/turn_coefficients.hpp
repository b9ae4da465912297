#pragma once

#include <span>

#include "panonav/core/portable_math.hpp"

namespace panonav {

/// Calls visit(k, cos(k turn), sin(k turn)) for k = 0 .. frequencies - 1.
template <class Visit>
void for_each_frequency(int frequencies, double turn_rad, const Visit& visit) {
  const auto [step_cosine, step_sine] = portable::cosine_sine(turn_rad);
  double cosine = 1.0;
  double sine = 0.0;
  for (int k = 0; k < frequencies; ++k) {
    visit(k, static_cast<float>(cosine), static_cast<float>(sine));
    const double next = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next;
  }
}

/// Rotates the coefficients of one row, frequencies 0 .. a.size() - 1, as a turn of the robot by
/// `turn_rad` does [S06 eq. 6].
inline void rotate_row(std::span<float> a, std::span<float> b, double turn_rad) {
  for_each_frequency(static_cast<int>(a.size()), turn_rad, [&](int k, float cosine, float sine) {
    const float turned = a[k] * cosine + b[k] * sine;
    b[k] = b[k] * cosine - a[k] * sine;
    a[k] = turned;
  });
}

}  // namespace panonav
