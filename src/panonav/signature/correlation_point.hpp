#pragma once

#include <cstddef>
#include <span>

#include "panonav/core/portable_math.hpp"

namespace panonav {

/// Value and first two derivatives, at one rotation, of the correlation of two views [S06 eq. 33],
///   C(sigma) = Re sum_k (real[k] + j imaginary[k]) exp(-j k sigma), k = 1 .. K = size - 1,
/// summed over all rows. Entry 0 of both arrays is ignored.
/// The compass uses double precision, homing single precision.
template <class Real>
struct CorrelationPoint {
  Real value = 0;      ///< C(sigma), in the square of the views' unit
  Real slope = 0;      ///< dC / dsigma, for each radian
  Real curvature = 0;  ///< the second derivative, below 0 at a maximum
};

/// Evaluates the correlation at `turn_rad`. Cost: one sine, one cosine, and a few multiplications
/// for each frequency.
template <class Real>
[[nodiscard]] CorrelationPoint<Real> correlation_at(std::span<const Real> term_real,
                                                    std::span<const Real> term_imaginary,
                                                    Real turn_rad) noexcept {
  const auto step = portable::cosine_sine(static_cast<double>(turn_rad));
  const auto step_real = static_cast<Real>(step.cosine);
  const auto step_imaginary = static_cast<Real>(-step.sine);
  Real real = 1;
  Real imaginary = 0;
  CorrelationPoint<Real> point;
  for (std::size_t k = 1; k < term_real.size(); ++k) {
    const Real next = real * step_real - imaginary * step_imaginary;
    imaginary = real * step_imaginary + imaginary * step_real;
    real = next;
    const Real cosine = term_real[k] * real - term_imaginary[k] * imaginary;
    const Real sine = term_real[k] * imaginary + term_imaginary[k] * real;
    const auto frequency = static_cast<Real>(k);
    point.value += cosine;
    point.slope += frequency * sine;
    point.curvature -= frequency * frequency * cosine;
  }
  return point;
}

}  // namespace panonav
