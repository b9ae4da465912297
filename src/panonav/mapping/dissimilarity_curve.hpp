#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// Distance between two places, read from the dissimilarity of their views, with its error [M04
/// figures 7 and 12]. Distances are in the unit of the arrangement to which it was fitted.
/// Invariant: rising (not strictly) with the dissimilarity, nowhere negative.
class DissimilarityCurve {
 public:
  /// A pair of views in the arrangement so far.
  struct Sample {
    double dissimilarity = 0.0;  ///< of the two views, >= 0
    double distance = 0.0;       ///< of their places in the arrangement, >= 0
  };

  /// Starts with distance = dissimilarity * slope, without error and without a limit, before there
  /// is an arrangement. Throws ContractError unless slope is finite and > 0.
  explicit DissimilarityCurve(double slope);

  /// Fits the mean distance of pairs of equal dissimilarity, by isotonic regression over groups of
  /// pairs, and the root mean square of its residuals. Below the first group the curve is straight
  /// down to zero at dissimilarity 0. `level`: dissimilarity of far views, where the curve is flat;
  /// correlation ends at 95 % of it. Throws ContractError on no pairs, or values that are not
  /// finite and >= 0. Cost: n log n.
  DissimilarityCurve(std::span<const Sample> pairs, double level);

  /// Distance at a dissimilarity; beyond the last knot the distance there.
  [[nodiscard]] double distance(double dissimilarity) const;
  /// E of [M04 eq. 5]: root mean square error of a distance; rising with it.
  [[nodiscard]] double error(double distance) const;
  /// x_1 of [M04 eq. 5]: largest distance that can be read. Views above `max_dissimilarity`
  /// are unrelated.
  [[nodiscard]] double range() const noexcept { return range_; }
  /// Dissimilarity at `range`.
  [[nodiscard]] double max_dissimilarity() const noexcept { return max_dissimilarity_; }
  /// K of [M04 eq. 5]: stiffness of a spring of this rest length, 1 .. 0 and 0.1 at `range`.
  [[nodiscard]] double stiffness(double distance) const;

  /// A point of the curve, for plots.
  struct Knot {
    double dissimilarity = 0.0;  ///< of the pairs
    double distance = 0.0;       ///< their mean
    double error = 0.0;          ///< root mean square of their distances
  };
  /// The points that straight lines join, ascending by dissimilarity.
  [[nodiscard]] std::span<const Knot> knots() const& noexcept { return knots_; }
  std::span<const Knot> knots() const&& = delete;  // would dangle

 private:
  std::vector<Knot> knots_;  // ascending in all three; the first one is 0
  double range_ = 0.0;
  double max_dissimilarity_ = 0.0;
};

}  // namespace panonav
