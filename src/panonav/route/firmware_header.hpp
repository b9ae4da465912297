#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "panonav/route/snapshot_chain.hpp"

namespace panonav {

/// Returns a C header with constant arrays for the firmware of a small robot, which a linker places
/// in flash memory: `panonav_chain`, the packed form of the chain, and `panonav_sampler`, its
/// `SnapshotSampler`'s table as from `make_sampler_pixels`; without pixels only the chain. Throws
/// as `SnapshotChain::pack`. Cost: linear in the bytes.
[[nodiscard]] std::string format_firmware_header(const SnapshotChain& chain,
                                                 std::span<const std::uint16_t> sampler_pixels);

}  // namespace panonav
