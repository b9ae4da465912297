#pragma once

#include <optional>
#include <span>

#include "panonav/localisation/sector_localiser.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Localises narrow pictures in a memory of panoramas, as `PlaceRecogniser` does.
class SectorRecogniser {
 public:
  /// Loads the features of all views. `memory` must outlive *this. `model`: learnt from the memory
  /// before; nullopt: it is learnt now. Throws FileError if the memory has no features for narrow
  /// pictures or unknown elevations.
  SectorRecogniser(const MemoryFile& file, const VisualMemory& memory, PictureSource source,
                   const std::optional<SectorModel>& model);

  /// Localises an observation, whose own layout comes before that of the constructor; lists up to
  /// `top` matches. Throws ContractError (FileError if the
  /// observation has a file) if the picture is no image, its size is not that of the camera, or its
  /// field of view is unknown.
  [[nodiscard]] Place localise(const Observation& observation, int top,
                               std::span<const ViewId> excluded) const;

 private:
  /// Returns the features of a picture, or of those of a rig's cameras together. Throws
  /// ContractError if they show nothing of the memory's elevations.
  [[nodiscard]] SectorQuery make_query(ImageView image, const Camera& camera,
                                       const Tilt& tilt) const;

  MemoryHeader header_;  // its cylinders are those of gradient features
  PictureSource source_;
  SectorLocaliser localiser_;
};

}  // namespace panonav
