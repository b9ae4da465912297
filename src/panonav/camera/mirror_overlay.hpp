#pragma once

#include <optional>

#include "panonav/camera/find_mirror.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// A colour copy of the image for a person to check: the rim in green, the inner radius in orange
/// (where found), the centre as a red cross, and from inner radius to rim a yellow line in the
/// robot's forward direction where it is given (image angle, counter-clockwise as shown, from +u).
/// Throws ContractError when the image's size is not the mirror's.
[[nodiscard]] Image draw_mirror(ImageView image, const MirrorCircle& mirror,
                                std::optional<double> forward_angle_rad = std::nullopt);

}  // namespace panonav
