#pragma once

#include <cstdint>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav::simulation {

/// Encodes a 360 degree image of the whole sphere as JPEG with the XMP data of Photo Spheres
/// (namespace GPano): projection, sizes, and the direction of the image's centre, which is the
/// robot's forward direction: degrees clockwise from north, the scene's y axis. Pitch (up) and roll
/// (clockwise) of a tilted robot are stated, too. Throws ContractError as `encode_jpeg`.
[[nodiscard]] std::vector<std::uint8_t> encode_photo_sphere(ImageView image, const Pose2& pose,
                                                            const Tilt& tilt);

}  // namespace panonav::simulation
