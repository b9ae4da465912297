#include "reports/home_answer.hpp"

#include <cmath>
#include <numbers>

#include "cli/session.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

std::string describe_direction(double direction_rad) {
  const double off = std::abs(degrees(direction_rad));
  if (off < 0.5) return "straight ahead";
  if (off >= 179.5) return "straight behind";
  return format_fixed(off, 0) + (format_fixed(off, 0) == "1" ? " degree" : " degrees") +
         " to the " + (direction_rad > 0.0 ? "left" : "right");
}

std::string describe_rotation(double heading_rad) {
  // heading_rad is the heading at home in the robot's present frame; the robot has rotated by its
  // negative.
  const double turned = wrap_angle(-heading_rad);
  if (std::abs(degrees(turned)) < 0.5) return "same heading as at home";
  if (std::abs(degrees(turned)) >= 179.5) return "heading opposite to that at home";
  return "the robot has rotated by " + describe_direction(turned);
}

std::string explain_no_direction(const HomingResult& way) {
  if (!way.known) return "the views are not more similar than random views";
  // Above it more than half of the energy of either view is found in the other.
  constexpr double alike = std::numbers::sqrt2 / 2.0;
  if (way.vector.correlation >= alike) return "the robot is already at home";
  return "the views are too different";
}

}  // namespace panonav::command
