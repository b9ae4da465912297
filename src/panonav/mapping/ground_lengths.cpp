#include "panonav/mapping/ground_lengths.hpp"

#include <array>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/mapping/internal/ground_displacement.hpp"
#include "panonav/mapping/visual_odometry.hpp"

namespace panonav {

namespace {

/// Largest and smallest number of latest steps from which the scale is estimated.
constexpr std::size_t max_scale_steps = 15;
constexpr std::size_t min_scale_steps = 3;
/// Start lengths of the search before a scale is known, as multiples of the length by the default
/// scale.
constexpr std::array<double, 4> initial_length_factors{0.5, 1.0, 2.0, 4.0};
/// Largest relative standard deviation of an accepted length.
constexpr double max_relative_deviation = 0.2;
/// Largest ratio of a length to the one that the scale predicts, or of the prediction to the
/// length.
constexpr double max_relative_change = 2.0;
/// Shortest length, in camera heights, from which the scale is learnt: shorter ones are dominated
/// by the rounding of pixels.
constexpr double min_length = 0.03;

}  // namespace

GroundLengths::GroundLengths(double camera_height_m) : camera_height_m_(camera_height_m) {
  require(std::isfinite(camera_height_m) && camera_height_m > 0.0, "camera_height_m",
          camera_height_m, "> 0");
}

std::optional<double> GroundLengths::scale_m() const {
  if (latest_scales_m_.size() < min_scale_steps) return std::nullopt;
  return upper_median(latest_scales_m_);
}

bool GroundLengths::correct_step(const HomingView& before, const HomingView& after,
                                 VisualStep& step) {
  Pose2& motion = step.before_from_after;
  const double length_m = std::hypot(motion.x_m, motion.y_m);
  if (!(length_m > 0.0)) return true;
  const auto scaled = [&motion](double factor) {
    return Pose2{motion.x_m * factor, motion.y_m * factor, motion.heading_rad};
  };
  const auto known_m = scale_m();
  std::optional<GroundDisplacement> found;
  const auto search_near = [&](double guess_m) {
    const auto one =
        ground_displacement(before, after, scaled(guess_m / length_m / camera_height_m_));
    if (one && (!found || one->difference < found->difference)) found = one;
  };
  if (known_m) {
    search_near(*known_m * step.length_in_views);
  } else {
    for (const double guess : initial_length_factors) search_near(guess * length_m);
  }
  if (found) {
    const double length = std::hypot(found->x, found->y);
    const double expected = known_m ? *known_m * step.length_in_views / camera_height_m_ : length;
    if (found->deviation < max_relative_deviation * length &&
        length < max_relative_change * expected && expected < max_relative_change * length) {
      if (length > min_length) {
        ++measured_steps_;
        latest_scales_m_.push_back(length * camera_height_m_ / step.length_in_views);
      }
      if (latest_scales_m_.size() > max_scale_steps)
        latest_scales_m_.erase(latest_scales_m_.begin());
      motion = {found->x * camera_height_m_, found->y * camera_height_m_, motion.heading_rad};
      return true;
    }
  }
  if (!known_m) return false;
  motion = scaled(*known_m * step.length_in_views / length_m);
  return true;
}

}  // namespace panonav
