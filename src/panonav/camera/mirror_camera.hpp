#pragma once

#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/camera/find_mirror.hpp"
#include "panonav/core/image.hpp"

namespace panonav {

/// Knowledge of a mirror camera beyond its picture.
struct MirrorKnowledge {
  /// Any model of a mirror camera. If the mirror's shape is unknown, use EquiangularModel with the
  /// elevations visible at the inner radius and at the rim.
  CameraModel model;
  /// Replaces the inner radius found in the image; 0 if neither is set.
  std::optional<double> inner_radius_px = std::nullopt;
  ColumnDirection direction = ColumnDirection::clockwise;  ///< see Camera
  double forward_angle_rad = 0.0;                          ///< see Camera
  bool is_model_assumed = false;  ///< the shape of the mirror or its elevations are a guess
};

/// Makes the camera of a mirror found in an image. Throws ContractError when model and circle do
/// not fit together, see validate(const Camera&).
[[nodiscard]] Camera camera_from_mirror(const MirrorCircle& mirror,
                                        const MirrorKnowledge& knowledge);

/// Fits the focal length so that `elevation_rad` is seen `radius_px` from the centre, as on the
/// rim of a mirror whose edge shows a known elevation. Throws ContractError unless the model sees
/// that elevation and radius_px > 0.
[[nodiscard]] HyperboloidalModel fit_focal_length(HyperboloidalModel model, double radius_px,
                                                  double elevation_rad);
/// Fits the focal length of a unified model in the same way, with the same exceptions.
[[nodiscard]] UnifiedModel fit_focal_length(UnifiedModel model, double radius_px,
                                            double elevation_rad);

/// Draws the mirror on a colour copy of the image: the rim in green, the inner radius in orange (if
/// found), the centre as a red cross, and a yellow line from inner radius to rim in the robot's
/// forward direction if `forward_angle_rad` is set (see Camera). Throws ContractError if the
/// image's size is not the mirror's.
[[nodiscard]] Image draw_mirror(ImageView image, const MirrorCircle& mirror,
                                std::optional<double> forward_angle_rad = std::nullopt);

}  // namespace panonav
