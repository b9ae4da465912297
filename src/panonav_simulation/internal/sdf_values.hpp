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

/// Fault of one thing of a world, which is therefore left out.
struct Unusable {
  std::string why;
};

/// Computes the brightness of a colour (Rec. 601).
[[nodiscard]] float brightness(const Colour& colour);

/// Reads the colour that a child of `parent` has; `nullopt` when there is none or it is no colour.
[[nodiscard]] std::optional<Colour> read_colour(pugi::xml_node parent, const char* name);

/// Reads a number; `otherwise` where there is none.
[[nodiscard]] double read_number(pugi::xml_node parent, const char* name, double otherwise);

/// Reads `count` numbers of a shape; where the element has none, `otherwise` for each. Throws
/// Unusable.
[[nodiscard]] std::vector<double> read_size(pugi::xml_node shape, const char* name,
                                            std::size_t count,
                                            std::optional<double> otherwise = std::nullopt);

/// Reads `count` numbers above 0. Throws Unusable.
[[nodiscard]] std::vector<double> read_positive_size(pugi::xml_node shape, const char* name,
                                                     std::size_t count);

/// Returns the element of a part that says where it stands, <pose> or <origin>; null for none.
[[nodiscard]] pugi::xml_node pose_element(pugi::xml_node part);

/// Reads a <pose>: x y z, then roll pitch yaw or a quaternion x y z w. Throws Unusable.
[[nodiscard]] Affine3 read_pose(pugi::xml_node pose);

/// Returns the frame that the pose of a part names; empty for none.
[[nodiscard]] std::string_view find_pose_frame(pugi::xml_node part);

/// Returns a text on one line, in quotation marks, for messages.
[[nodiscard]] std::string quote(std::string_view text);

}  // namespace panonav::simulation
