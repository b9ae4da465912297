#include "panonav/relative_pose/view_pair.hpp"

#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

std::optional<PhaseReading> read_phases(const HomingView& a, const HomingView& b,
                                        const std::optional<HeadingWindow>& window) {
  std::optional<HeadingWindow> reverse = window;
  if (reverse) reverse->middle_rad = -reverse->middle_rad;
  const HomeVector from_a = home_vector(b, a, {}, window);
  const HomeVector from_b = home_vector(a, b, {}, reverse);
  if (!(from_a.correlation > 0.0) || !(from_b.correlation > 0.0)) return std::nullopt;
  const double turns_differ = angle_difference(from_a.heading_rad, -from_b.heading_rad);
  PhaseReading reading;
  reading.turn_rad = wrap_angle(-from_b.heading_rad + 0.5 * turns_differ);
  reading.turn_disagreement_rad = std::abs(turns_differ);
  reading.residual = 0.5 * (from_a.residual + from_b.residual);
  // As likely as not the vector is but the error of reading it.
  reading.points = from_a.confidence > 0.5 && from_b.confidence > 0.5;
  if (!reading.points) return reading;
  reading.length = 0.5 * (from_a.length() + from_b.length());
  reading.direction_a_rad = from_a.direction_rad();
  reading.direction_b_rad = from_b.direction_rad();
  reading.disagreement_rad = std::abs(wrap_angle(reading.direction_b_rad + reading.turn_rad -
                                                 reading.direction_a_rad - std::numbers::pi));
  return reading;
}

}  // namespace panonav
