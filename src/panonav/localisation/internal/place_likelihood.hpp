#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/internal/pose_likelihood.hpp"
#include "panonav/localisation/place.hpp"

namespace panonav {

/// Likelihood of an image by the answer of a localiser to it: the probability that the answer gives
/// to a pose, over that of a pose of which nothing is known. The position at each place of the
/// answer has a normal distribution, of which `PositionEstimate::radius_m` contains 95 %.
class PlaceLikelihood final : public PoseLikelihood {
 public:
  /// `views`: of the memory, `spacing_m` apart. `compass`: headings affect the likelihood.
  PlaceLikelihood(const Place& place, std::size_t views, double spacing_m, bool compass);

  void compute_log_ratios(const Particles& particles, std::span<double> ratios) override;
  [[nodiscard]] double log_ratio(const Pose2& pose) const;
  /// True if the answer names a position.
  [[nodiscard]] bool is_informed() const noexcept { return !parts_.empty(); }
  /// Draws a pose of the answer's places.
  [[nodiscard]] Pose2 sample(Random& random) const;

 private:
  /// A place of the answer.
  struct Part {
    double share;  // probability
    Point2 position;
    std::optional<double> heading_rad;
    double deviation_m;  // standard deviation of x, and that of y
  };
  void add(double share, const std::optional<PositionEstimate>& position,
           const std::optional<double>& heading_rad, double spacing_m);

  std::vector<Part> parts_;
  double unexplained_ = 1.0;  // probability of all other poses
  double area_m2_;            // area of all memorised places
  bool compass_;
};

}  // namespace panonav
