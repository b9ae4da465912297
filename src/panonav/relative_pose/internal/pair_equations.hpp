#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "panonav/relative_pose/internal/row_buffer.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// The coefficients of one pair of views, component-major like HomingView: those of component k of
/// all rows are contiguous. Up to 64 coefficients, such as one row or a snapshot, are on the stack,
/// more are on the heap.
class PairCoefficients {
 public:
  PairCoefficients(std::size_t rows, std::size_t components)
      : rows_(rows), size_(rows * components), values_(arrays * size_) {}

  /// The home view, rotated to the present heading.
  [[nodiscard]] float* home_a(int k) noexcept { return at(0, k); }
  [[nodiscard]] float* home_b(int k) noexcept { return at(1, k); }
  [[nodiscard]] float* current_a(int k) noexcept { return at(2, k); }
  [[nodiscard]] float* current_b(int k) noexcept { return at(3, k); }
  /// The view whose derivatives are used: the current view or the mean of both.
  [[nodiscard]] float* middle_a(int k) noexcept { return at(4, k); }
  [[nodiscard]] float* middle_b(int k) noexcept { return at(5, k); }
  /// Its derivative by elevation.
  [[nodiscard]] float* rise_a(int k) noexcept { return at(6, k); }
  [[nodiscard]] float* rise_b(int k) noexcept { return at(7, k); }

 private:
  static constexpr std::size_t arrays = 8;
  static constexpr std::size_t stacked = TurnCorrelation::max_frequencies + 2;
  [[nodiscard]] float* at(std::size_t array, int k) noexcept {
    return values_.numbers().data() + array * size_ + static_cast<std::size_t>(k) * rows_;
  }
  std::size_t rows_;
  std::size_t size_;
  RowBuffer<float, arrays * stacked> values_;  // written before they are read
};

/// Terms of each row that are the same for all components.
struct RowTerms {
  std::span<const float> weights;   ///< empty: all equal
  std::span<const float> approach;  ///< how fast things rise as the robot approaches; empty: 0
  std::span<const float> tangent;   ///< of the elevation; for `sum_tilt_equations` only
};

/// Normal equations of the correction of the heading, xi and eta, in this order [S06 eq. 30].
struct PairEquations {
  std::array<double, 6> matrix{};  ///< 00 01 02 11 12 22
  std::array<double, 3> right{};
  double energy = 0.0;           ///< of the difference of the views
  double energy_of_views = 0.0;  ///< of both views

  void add(const PairEquations& other, double weight) noexcept;
};

/// Additional sums for a tilt with two unknowns P and Q, in this order: products of P with heading,
/// xi and eta; the same of Q; PP, PQ and QQ; right sides of P and Q.
struct TiltEquations {
  std::array<double, 11> sums{};

  void add(const TiltEquations& other, double weight) noexcept;
};

/// Sums the equations of component k over all rows [S06 eq. 17-20].
[[nodiscard]] PairEquations sum_equations(PairCoefficients& coefficients, int k, std::size_t rows,
                                          const RowTerms& terms);
/// Sums the equations of a tilt of the robot for component k over all rows. A tilt moves things up
/// or down by P cos phi + Q sin phi, and things off the horizon sideways by tan(elevation) (P sin
/// phi - Q cos phi).
[[nodiscard]] TiltEquations sum_tilt_equations(PairCoefficients& coefficients, int k,
                                               std::size_t rows, const RowTerms& terms);

/// Eliminates the tilt from the normal equations. `certainty`: variance of the residual of an
/// equation over the expected variance of the tilt.
[[nodiscard]] PairEquations eliminate_tilt(PairEquations equations, const TiltEquations& tilt,
                                           double certainty) noexcept;

/// The solution of the normal equations.
struct PairSolution {
  double turn = 0.0;
  double xi = 0.0;
  double eta = 0.0;
  double explained = 0.0;  ///< energy that the solution explains
  /// Covariance of turn, xi and eta for unit variance of an equation: 00 01 02 11 12 22.
  std::array<double, 6> covariance{};
};

/// Solves the normal equations; unknowns on which the views do not depend stay 0.
[[nodiscard]] PairSolution solve(const PairEquations& equations) noexcept;

}  // namespace panonav
