#include "reports/home_answer.hpp"

#include <cmath>
#include <numbers>

#include "cli/session.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

std::string describe_direction(double direction_rad) {
  const double angle_deg = std::abs(degrees(direction_rad));
  if (angle_deg < 0.5) return "straight ahead";
  if (angle_deg >= 179.5) return "straight behind";
  return format_fixed(angle_deg, 0) + (format_fixed(angle_deg, 0) == "1" ? " degree" : " degrees") +
         " to the " + (direction_rad > 0.0 ? "left" : "right");
}

std::string describe_rotation(double heading_rad) {
  // heading_rad is the heading at home in the robot's current frame, so the robot has rotated by
  // -heading_rad.
  const double turned = wrap_angle(-heading_rad);
  if (std::abs(degrees(turned)) < 0.5) return "same heading as at home";
  if (std::abs(degrees(turned)) >= 179.5) return "heading opposite to that at home";
  return "the robot has rotated by " + describe_direction(turned);
}

std::string explain_no_direction(const HomingResult& result) {
  if (!result.evidence) return "the images have no more in common than those of unrelated places";
  // Correlation from which on each view explains more than half of the other's variance; chosen.
  constexpr double min_home_correlation = std::numbers::sqrt2 / 2.0;
  if (result.evidence->vector.correlation >= min_home_correlation)
    return "the robot is already at home";
  return "the views are too different";
}

}  // namespace panonav::command
