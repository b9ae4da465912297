#pragma once

#include <optional>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav::command {

/// The home view, turned as if the robot there faced the same way as here, above the current one;
/// clockwise with forward in the middle. Orange marks show the direction home, blue ones the
/// opposite: things spread out around the orange ones on the way and close up around the blue ones.
/// Without a home panorama the current one alone.
[[nodiscard]] Image picture_of_homing(const std::optional<Panorama>& home, const Panorama& current,
                                      const HomeVector& found, bool points);

/// Panoramas one above the other, each with a grey mark straight ahead.
[[nodiscard]] Image picture_of_views(const std::vector<Panorama>& views);

}  // namespace panonav::command
