#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav_server/http_server.hpp"

namespace panonav::server {

/// Largest accepted picture.
inline constexpr ImageLimits picture_limits{
    .side_px = 16384, .area_px = 33'554'432, .scanned_px = std::int64_t{16} * 33'554'432};

/// Reads the arguments of a request to localise a picture: `field_of_view_deg`, the angle between
/// the left and the right edge of a narrow picture in degrees, or "exif", which is that of the
/// picture's own data. Returns nullopt for pictures as the memory's, which have none. Throws
/// ContractError on other arguments, or a value out of range.
[[nodiscard]] std::optional<PictureSource> read_narrow_source(const HttpArguments& arguments);

/// Decodes a PNG or JPEG. Throws Error if it is none or too large.
[[nodiscard]] Observation decode_observation(std::string_view picture,
                                             std::optional<PictureSource> narrow_source);

}  // namespace panonav::server
