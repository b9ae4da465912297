#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav_simulation/internal/affine3.hpp"
#include "panonav_simulation/internal/xml.hpp"

namespace panonav::simulation {

/// Red, green, blue, 0 .. 1.
using Colour = std::array<float, 3>;

/// Reason why one part of a world cannot be used and is left out.
struct UnusablePart {
  std::string why;
};

/// Computes the brightness of a colour (Rec. 601).
[[nodiscard]] float brightness(const Colour& colour);

/// Reads a colour from the child `name` of `parent`; `nullopt` if there is none or it is not a
/// colour.
[[nodiscard]] std::optional<Colour> read_colour(pugi::xml_node parent, const char* name);

/// Reads a number from the child `name` of `parent`; returns `otherwise` if there is none.
[[nodiscard]] double read_number(pugi::xml_node parent, const char* name, double otherwise);

/// Reads `count` numbers from the child `name` of a shape; if it is missing or empty, returns
/// `otherwise` for each. Throws UnusablePart.
[[nodiscard]] std::vector<double> read_size(pugi::xml_node shape, const char* name,
                                            std::size_t count,
                                            std::optional<double> otherwise = std::nullopt);

/// Reads `count` numbers that must be above 0. Throws UnusablePart.
[[nodiscard]] std::vector<double> read_positive_size(pugi::xml_node shape, const char* name,
                                                     std::size_t count);

/// Returns the element with the pose of a part, <pose> or <origin>; a null node if there is none.
[[nodiscard]] pugi::xml_node find_pose_element(pugi::xml_node part);

/// Reads a <pose>: x y z, then roll pitch yaw (may be missing) or a quaternion x y z w. Throws
/// UnusablePart.
[[nodiscard]] Affine3 read_pose(pugi::xml_node pose);

/// Returns the name of the frame to which the pose of a part is relative; empty if it names none.
[[nodiscard]] std::string_view find_pose_frame(pugi::xml_node part);

/// Returns a text as one line in quotation marks, for messages.
[[nodiscard]] std::string quote(std::string_view text);

}  // namespace panonav::simulation
