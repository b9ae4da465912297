#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// Maps the dissimilarity of two views to the distance of their places and the error of that
/// distance [M04 figures 7 and 12]. Distances are in the unit of the arrangement to which the curve
/// was fitted. Invariant: distances are >= 0 and never decrease with the dissimilarity.
class DissimilarityCurve {
 public:
  /// A pair of views in the arrangement so far.
  struct Sample {
    double dissimilarity = 0.0;  ///< of the two views, >= 0
    double distance = 0.0;       ///< of their places in the arrangement, >= 0
  };

  /// Makes the straight line distance = dissimilarity * slope, with error 0 and without a limit,
  /// for use before there is an arrangement. Throws ContractError unless slope is finite and > 0.
  explicit DissimilarityCurve(double slope);

  /// Fits the mean distance of pairs of equal dissimilarity, by isotonic regression over groups of
  /// pairs, and the root mean square of its residuals. Below the first group the curve is a
  /// straight line to the origin. `level`: dissimilarity of far views, where the curve is flat;
  /// above 95 % of it, dissimilarity does not depend on the distance. Throws ContractError on no
  /// pairs, or values that are not finite and >= 0. Cost: n log n.
  DissimilarityCurve(std::span<const Sample> pairs, double level);

  /// Distance at a dissimilarity; constant beyond the last knot.
  [[nodiscard]] double distance(double dissimilarity) const;
  /// Root mean square error of a distance, E of [M04 eq. 5]; never decreases with the distance.
  [[nodiscard]] double error(double distance) const;
  /// Largest distance that can be estimated, x_1 of [M04 eq. 5]. Views above `max_dissimilarity`
  /// are unrelated.
  [[nodiscard]] double range() const noexcept { return range_; }
  /// Dissimilarity at `range`.
  [[nodiscard]] double max_dissimilarity() const noexcept { return max_dissimilarity_; }
  /// Stiffness of a spring of this rest length, K of [M04 eq. 5]: 1 where the error is 0, falling
  /// to 0.1 at `range`.
  [[nodiscard]] double stiffness(double distance) const;

  /// A point of the curve, for plots.
  struct Knot {
    double dissimilarity = 0.0;  ///< of the pairs
    double distance = 0.0;       ///< their mean
    double error = 0.0;          ///< root mean square of their distances
  };
  /// The points of the curve, ascending by dissimilarity; straight lines connect them.
  [[nodiscard]] std::span<const Knot> knots() const& noexcept { return knots_; }
  std::span<const Knot> knots() const&& = delete;  // would dangle

 private:
  std::vector<Knot> knots_;  // ascending in all three; the first one is 0
  double range_ = 0.0;
  double max_dissimilarity_ = 0.0;
};

}  // namespace panonav
