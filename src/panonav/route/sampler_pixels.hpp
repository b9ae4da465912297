#pragma once

#include <cstdint>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/route/snapshot_sampler.hpp"

namespace panonav {

/// Computes the table of a `SnapshotSampler`: the pixel that shows each direction, rows * azimuths
/// * elevations of them, evenly spaced within the band. Throws ContractError on a shape out of its
/// ranges, if the picture has more than 65,536 pixels, or if the camera does not show a direction.
[[nodiscard]] std::vector<std::uint16_t> make_sampler_pixels(const Camera& camera,
                                                             const ElevationBand& band,
                                                             const SamplerShape& shape = {});

}  // namespace panonav
