#pragma once

#include <algorithm>
#include <optional>

#include "panonav/core/portable_math.hpp"
#include "panonav/relative_pose/home_vector.hpp"

namespace panonav {

/// Lengths of the steps of an approach to a view, and whether the approach still comes nearer.
/// Needs no heap memory, and gives the same bits on all processors.
class ApproachSteps {
 public:
  /// Begins an approach, or another stage of it, at an image difference to the view of the goal.
  void restart(double difference = largest_difference) noexcept {
    *this = {};
    min_difference_ = difference;
  }
  /// Takes the image difference to the view of the goal at the present step.
  void add_difference(double difference) noexcept {
    ++steps_since_min_;
    if (difference < min_difference_) {
      min_difference_ = difference;
      steps_since_min_ = 0;
    }
  }
  /// Number of steps since the views were most similar.
  [[nodiscard]] int steps_since_min() const noexcept { return steps_since_min_; }
  /// Returns the length of the next step, min(l_max, R length of `vector`) [S06 section 3, step 3]:
  /// halved when the vector opposes the one before, and restored step by step when they agree.
  /// `typical_distance_m` is R, `max_step_m` is l_max; both > 0.
  [[nodiscard]] double next_m(const HomeVector& vector, double typical_distance_m,
                              double max_step_m) noexcept {
    // Directions are compared in the frame of the robot at the goal, which does not change.
    const double direction_rad = vector.direction_rad() - vector.heading_rad;
    if (last_direction_rad_) {
      const bool is_opposing = portable::cos(direction_rad - *last_direction_rad_) < 0.0;
      factor_ = is_opposing ? factor_ * opposing_factor : std::min(1.0, factor_ * agreeing_factor);
    }
    last_direction_rad_ = direction_rad;
    return factor_ * std::min(max_step_m, typical_distance_m * vector.length());
  }

 private:
  static constexpr double largest_difference = 2.0;  // of image_difference
  static constexpr double opposing_factor = 0.5;
  // Two agreeing steps do not undo one halving, so steps shrink when directions are random.
  static constexpr double agreeing_factor = 1.25;
  double factor_ = 1.0;
  std::optional<double> last_direction_rad_;
  double min_difference_ = largest_difference;
  int steps_since_min_ = 0;
};

}  // namespace panonav
