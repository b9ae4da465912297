#include "panonav/relative_pose/view_pair.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

Pose2 PhaseReading::a_from_b(double unit) const {
  if (!has_direction) return {0.0, 0.0, turn_rad};
  const double by_b_rad = direction_b_rad + turn_rad - std::numbers::pi;
  const double direction_rad = direction_a_rad + 0.5 * angle_difference(by_b_rad, direction_a_rad);
  return {unit * length * std::cos(direction_rad), unit * length * std::sin(direction_rad),
          turn_rad};
}

PhaseReading PhaseReading::reversed() const {
  PhaseReading reverse = *this;
  reverse.turn_rad = wrap_angle(-turn_rad);
  std::swap(reverse.direction_a_rad, reverse.direction_b_rad);
  return reverse;
}

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
  reading.correlation = 0.5 * (from_a.correlation + from_b.correlation);
  reading.has_direction = from_a.has_direction() && from_b.has_direction();
  if (!reading.has_direction) return reading;
  reading.length = 0.5 * (from_a.length() + from_b.length());
  reading.direction_a_rad = from_a.direction_rad();
  reading.direction_b_rad = from_b.direction_rad();
  reading.disagreement_rad = std::abs(wrap_angle(reading.direction_b_rad + reading.turn_rad -
                                                 reading.direction_a_rad - std::numbers::pi));
  return reading;
}

}  // namespace panonav
