#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace panonav {

/// The correlation of two views against the turn between them, all rows summed [S06 eq. 33],
///   C(sigma) = Re sum_k (real[k] + j imaginary[k]) exp(-j k sigma), k = 1 .. K = size - 1,
/// and its first two derivatives at one turn. Entry 0 does not count. The compass takes double
/// precision, homing single.
template <class Real>
struct CorrelationPoint {
  Real value = 0;
  Real slope = 0;
  Real curvature = 0;
};

/// Cost: a sine, a cosine and a few multiplications a frequency.
template <class Real>
[[nodiscard]] CorrelationPoint<Real> correlation_at(std::span<const Real> term_real,
                                                    std::span<const Real> term_imaginary,
                                                    Real turn_rad) noexcept {
  const Real step_real = std::cos(turn_rad);
  const Real step_imaginary = -std::sin(turn_rad);
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

/// S06's sequential rule, as published [S06 eq. 40-43, sign of eq. 41 corrected]: each component
/// refines the estimate of those before. When the weight of the first is below a tenth of the mean
/// a second estimate starts at the opposite heading, and the one of higher correlation is taken.
/// `differences_rad`: arg of each term; `weights`: k^2 times its size; entry 0 does not count, K >=
/// 1. `value_at`: C at a turn. In radians, not wrapped.
template <class Real, class Value>
[[nodiscard]] Real sequential_turn(std::span<const Real> differences_rad,
                                   std::span<const Real> weights, const Value& value_at) {
  constexpr auto pi = std::numbers::pi_v<Real>;
  Real all = 0;
  for (std::size_t k = 1; k < weights.size(); ++k) all += weights[k];
  const auto refined_from = [&](Real first_rad) {
    Real turn = first_rad;
    Real sum = weights[1];
    for (std::size_t k = 2; k < weights.size(); ++k) {
      if (!(weights[k] > 0)) continue;
      const auto frequency = static_cast<Real>(k);
      const Real turns = std::nearbyint((frequency * turn - differences_rad[k]) / (2 * pi));
      const Real told = (differences_rad[k] + 2 * pi * turns) / frequency;
      turn = (sum * turn + weights[k] * told) / (sum + weights[k]);
      sum += weights[k];
    }
    return turn;
  };
  const Real first = refined_from(differences_rad[1]);
  const Real tenth_of_mean = static_cast<Real>(0.1) * all / static_cast<Real>(weights.size() - 1);
  if (weights[1] >= tenth_of_mean) return first;
  const Real opposite = refined_from(differences_rad[1] + pi);
  return value_at(opposite) > value_at(first) ? opposite : first;
}

}  // namespace panonav
