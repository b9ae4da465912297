#pragma once

#include <algorithm>
#include <cmath>

namespace panonav {

/// Probability that the robot is in the memorised area, from image to image by Bayes' rule
/// (docs/decisions.md, "Lost is a second belief").
class InsideBelief {
 public:
  /// Log-likelihood ratio that 1 % of the views of other places reach by chance. Limits the
  /// evidence of one image against being in the memorised area.
  static constexpr double chance_log_ratio = 1.0;
  static constexpr double p_return = 0.1;  ///< that the robot comes back, from image to image

  /// Restarts, before the first image: undecided unless the robot is known to be inside.
  void restart(bool is_known) noexcept { probability_ = is_known ? 1.0 - p_leave : 0.5; }
  [[nodiscard]] double probability() const noexcept { return probability_; }
  /// Updates the belief by an image. `log_ratio`: how much better it fits a memorised place than by
  /// chance. At most odds of 150 for being inside, which a few images can refute
  /// (tests/localisation/monte_carlo_test.cpp).
  void update(double log_ratio) {
    probability_ = probability_ * (1.0 - p_leave) + (1.0 - probability_) * p_return;
    const double ratio = std::exp(std::clamp(log_ratio, -chance_log_ratio, max_log_ratio));
    probability_ = probability_ * ratio / (probability_ * ratio + 1.0 - probability_);
  }

 private:
  static constexpr double p_leave = 0.02;  // that the robot leaves, from image to image
  static constexpr double max_log_ratio = 5.0;

  double probability_ = 0.5;
};

}  // namespace panonav
