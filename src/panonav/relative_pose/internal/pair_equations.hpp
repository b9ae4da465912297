#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "panonav/relative_pose/turn_correlation.hpp"

// The least squares of Fourier homing: inside of fourier_homing.cpp, not for users.

namespace panonav {

/// What is computed for one pair of views, component-major like HomingView: component k of all rows
/// lies together. One row lives on the stack, more rows on the heap.
class PairCoefficients {
 public:
  PairCoefficients(std::size_t rows, std::size_t components)
      : rows_(rows), size_(rows * components) {
    if (arrays * size_ > on_stack_.size()) on_heap_.resize(arrays * size_);
  }

  [[nodiscard]] float* home_a(int k) noexcept {
    return at(0, k);
  }  ///< turned as the robot faces now
  [[nodiscard]] float* home_b(int k) noexcept { return at(1, k); }
  [[nodiscard]] float* current_a(int k) noexcept { return at(2, k); }
  [[nodiscard]] float* current_b(int k) noexcept { return at(3, k); }
  /// The view whose slope counts.
  [[nodiscard]] float* middle_a(int k) noexcept { return at(4, k); }
  [[nodiscard]] float* middle_b(int k) noexcept { return at(5, k); }
  /// Its change with elevation.
  [[nodiscard]] float* rise_a(int k) noexcept { return at(6, k); }
  [[nodiscard]] float* rise_b(int k) noexcept { return at(7, k); }

 private:
  static constexpr std::size_t arrays = 8;
  static constexpr std::size_t stacked = TurnCorrelation::max_frequencies + 2;
  [[nodiscard]] float* at(std::size_t array, int k) noexcept {
    float* const first = on_heap_.empty() ? on_stack_.data() : on_heap_.data();
    return first + array * size_ + static_cast<std::size_t>(k) * rows_;
  }
  std::size_t rows_;
  std::size_t size_;
  std::array<float, arrays * stacked> on_stack_;  // not initialised: written before it is read
  std::vector<float> on_heap_;
};

/// Of each row, what is the same for all components.
struct RowTerms {
  std::span<const float> weights;   ///< empty: all alike
  std::span<const float> approach;  ///< how fast things rise as the robot comes nearer; empty: not
  std::span<const float> tangent;   ///< of the elevation; for `tilt_equations` only
};

/// Normal equations of the correction of the heading, xi and eta, in this order [S06 eq. 30].
struct PairEquations {
  std::array<double, 6> matrix{};  ///< 00 01 02 11 12 22
  std::array<double, 3> right{};
  double energy = 0.0;           ///< of what is to be explained
  double energy_of_views = 0.0;  ///< of both

  void add(const PairEquations& other, double weight) noexcept;
};

/// What a tilt in two directions, P and Q, adds to them: PD Px Pe, QD Qx Qe, PP PQ QQ, right sides
/// P Q.
struct TiltEquations {
  std::array<double, 11> sums{};

  void add(const TiltEquations& other, double weight) noexcept;
};

/// What component k of all rows contributes.
[[nodiscard]] PairEquations pair_equations(PairCoefficients& coefficients, int k, std::size_t rows,
                                           const RowTerms& terms);
/// The same of a tilt of the robot, which moves things up and down by P cos phi + Q sin phi, and
/// those off the horizon to the side by tan(elevation) (P sin phi - Q cos phi).
[[nodiscard]] TiltEquations tilt_equations(PairCoefficients& coefficients, int k, std::size_t rows,
                                           const RowTerms& terms);

/// The normal equations once the tilt that fits best is taken out. `certain`: the inverse variance
/// of the tilt, in units of that of an equation.
[[nodiscard]] PairEquations without_tilt(PairEquations equations, const TiltEquations& tilt,
                                         double certain) noexcept;

struct PairSolution {
  double turn = 0.0;
  double xi = 0.0;
  double eta = 0.0;
  double explained = 0.0;
  double variance = 0.0;  ///< of xi and eta, for unit variance of an equation
};

/// Directions in which the views tell nothing stay 0.
[[nodiscard]] PairSolution solve(const PairEquations& equations) noexcept;

}  // namespace panonav
