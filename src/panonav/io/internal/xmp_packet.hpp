#pragma once

#include <istream>
#include <optional>
#include <string>

namespace panonav::detail {

/// Returns the XMP text of a JPEG (in an APP1 segment) or a PNG (in an iTXt chunk, also compressed)
/// from its beginning on. nullopt if there is none, it has more than 1 MB, or the file is damaged
/// before it. Cost: skips all other segments.
[[nodiscard]] std::optional<std::string> read_xmp_packet(std::istream& file);

}  // namespace panonav::detail
