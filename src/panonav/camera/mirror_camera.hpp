#pragma once

#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/camera/find_mirror.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// What a user knows of a mirror camera beyond its picture.
struct MirrorKnowledge {
  /// Any but EquirectangularModel. When the mirror's shape is unknown: EquiangularModel with the
  /// elevations seen at the inner radius and at the rim.
  CameraModel model;
  /// Overrides what was found; for when nothing was found.
  std::optional<double> inner_radius_px = std::nullopt;
  ColumnDirection direction = ColumnDirection::clockwise;  ///< see Camera
  double forward_angle_rad = 0.0;                          ///< see Camera
};

/// The camera of a mirror found in an image. Where no inner radius is known or found it is 0.
/// Throws ContractError when model and circle do not fit together, see validate(const Camera&).
[[nodiscard]] Camera camera_from_mirror(const MirrorCircle& mirror,
                                        const MirrorKnowledge& knowledge);

/// The same mirror with the focal length with which `elevation_rad` is seen `radius_px` from the
/// centre: how a focal length follows from the rim when the elevation at the mirror's edge is
/// known. Throws ContractError unless the model sees that elevation and radius_px > 0.
[[nodiscard]] HyperboloidalModel with_elevation_at(HyperboloidalModel model, double radius_px,
                                                   double elevation_rad);
/// The same for a unified model. Throws as above.
[[nodiscard]] UnifiedModel with_elevation_at(UnifiedModel model, double radius_px,
                                             double elevation_rad);

/// A colour copy of the image for a person to check: the rim in green, the inner radius in orange
/// (where found), the centre as a red cross, and from inner radius to rim a yellow line in the
/// robot's forward direction where it is given (image angle, counter-clockwise as shown, from +u).
/// Throws ContractError when the image's size is not the mirror's.
[[nodiscard]] Image draw_mirror(ImageView image, const MirrorCircle& mirror,
                                std::optional<double> forward_angle_rad = std::nullopt);

}  // namespace panonav
