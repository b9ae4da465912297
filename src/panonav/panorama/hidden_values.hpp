#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/unwarper.hpp"

namespace panonav {

/// Finds the values of the unwarped panorama that depend on masked pixels (0 in `mask`), which show
/// the robot itself: rows x columns entries, row-major, 1 where hidden. `mask` has one channel and
/// the size of the camera's images. Throws ContractError on any other mask, and if all values are
/// hidden.
[[nodiscard]] std::vector<std::uint8_t> find_hidden_values(ImageView mask,
                                                           const Unwarper& unwarper);

/// Replaces the hidden values of each row by linear interpolation, round the cylinder, between the
/// visible values on both sides of the gap. For rows whose power spectrum falls as 1 / f^2, as in
/// natural images, this estimate has the smallest mean squared error; and it leaves no edge at the
/// ends of the gap, which would turn with the robot. A row without visible values becomes the
/// mean of all visible values. Throws ContractError unless `hidden` has one entry for each value
/// and one of them is 0.
void fill_hidden_values(Panorama& panorama, std::span<const std::uint8_t> hidden);

}  // namespace panonav
