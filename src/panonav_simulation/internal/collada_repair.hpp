#pragma once

#include <string>
#include <string_view>

namespace panonav::simulation {

/// Rewrites a COLLADA text so that the importer reads its surfaces and materials, whatever is wrong
/// with the rest. Cameras, lights, animations, physics, normals and vertex colours are dropped,
/// skins become plain geometry, and polygons with holes are cut open. Numbers that are none become
/// NaN, lengths of lists are corrected, and polygons that name vertices that do not exist are left
/// out. O(length). Throws Error if the text is no XML (as `parse_xml`).
[[nodiscard]] std::string repair_collada(std::string_view text);

}  // namespace panonav::simulation
