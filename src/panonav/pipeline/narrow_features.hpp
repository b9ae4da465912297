#pragma once

#include <cstdint>
#include <optional>
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

/// Computes the features that a memory stores with its views: local features, and gradient features
/// if the memory takes narrow pictures. Several threads may use one encoder concurrently.
class FeatureEncoder {
 public:
  /// `source`: layout of the images. `narrow`: also gradient features.
  FeatureEncoder(const MemoryHeader& header, const PictureSource& source, bool narrow);

  /// Returns the packed features of an observation whose panorama is `panorama`. Gradient features
  /// come from a finer cylinder of a picture (`find_gradient_shape`); a ready panorama is enlarged.
  /// Throws ContractError if elevations are unknown.
  [[nodiscard]] std::vector<std::uint8_t> packed(const Observation& observation,
                                                 const Panorama& panorama) const;

 private:
  MemoryHeader header_;
  std::optional<ViewEncoder> fine_;  // set if narrow
};

/// Returns the header of a memory whose cylinders are those of gradient features.
[[nodiscard]] MemoryHeader refine_header(const MemoryHeader& header);

}  // namespace panonav
