#pragma once

#include <optional>

#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/pipeline/view_encoder.hpp"

namespace panonav {

/// What a localisation makes of one observation, each part where it is needed and once.
class AskedView {
 public:
  /// Both must outlive it.
  AskedView(const ViewEncoder& encoder, const Observation& seen) : encoder_(encoder), seen_(seen) {}

  /// `by_features`: the panorama is needed in any case.
  [[nodiscard]] PackedSignature query(bool by_features) {
    return by_features ? encoder_.packed(panorama()) : encoder_.packed(seen_);
  }
  [[nodiscard]] QueryFeatures features() {
    return [this](Handedness handedness) {
      return encoder_.features(handedness == Handedness::as_seen ? panorama()
                                                                 : mirrored(panorama()));
    };
  }

 private:
  const Panorama& panorama() {
    if (!unwarped_) unwarped_ = encoder_.panorama(seen_);
    return *unwarped_;
  }
  const ViewEncoder& encoder_;
  const Observation& seen_;
  std::optional<Panorama> unwarped_;
};

}  // namespace panonav
