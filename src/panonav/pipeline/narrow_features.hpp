#pragma once

#include <cstdint>
#include <vector>

#include "panonav/localisation/sector_localiser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// True if the memory stores features by which narrow pictures are localised (`GradientFeatures`)
/// with its views. Set when the memory is created (`MemoriserOptions::narrow`).
[[nodiscard]] bool has_narrow_features(const MemoryFile& file);
/// Marks a new memory as one that stores these features.
void set_narrow_features(MemoryFile& file);
/// Throws FileError unless the memory stores these features.
void require_narrow_features(const MemoryFile& file);

/// Returns a function that reads the features of a view from the file at each call. The file must
/// outlive the function. Throws as `require_narrow_features`.
[[nodiscard]] GradientSource make_gradient_source(const MemoryFile& file);

/// Returns the packed features of a view for the memory: local features, and gradient features if
/// `narrow`. Throws ContractError if elevations are unknown.
[[nodiscard]] std::vector<std::uint8_t> pack_features(const ViewEncoder& encoder,
                                                      const Panorama& panorama, bool narrow);

}  // namespace panonav
