#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/unwarper.hpp"

namespace panonav {

/// Finds the values of the unwarped panorama that depend on pixels of `mask` that are 0, where the
/// robot itself is seen: rows x columns entries, row-major, 1 where hidden. `mask` has one channel
/// and the size of the camera's images. Throws ContractError on another mask, and on one that hides
/// everything.
[[nodiscard]] std::vector<std::uint8_t> find_hidden_values(ImageView mask,
                                                           const Unwarper& unwarper);

/// Replaces the hidden values of each row by the straight line, round the cylinder, between the
/// seen values on either side. For rows whose power falls as 1 / f^2, as it does in natural
/// pictures, no other estimate from the seen values has a smaller mean squared error, and no edge
/// appears at the ends of the gap that would stay with the robot when it turns. A row with nothing
/// seen becomes the mean of all seen values. Throws ContractError unless `hidden` has one entry for
/// each value and one of them is 0.
void fill_hidden_values(Panorama& panorama, std::span<const std::uint8_t> hidden);

}  // namespace panonav
