#pragma once

#include <optional>

#include "panonav/camera/camera.hpp"

namespace panonav {

/// An offset from the centre of a mirror or lens, in pixels.
struct ImageOffset {
  double right_px = 0.0;
  double down_px = 0.0;
};

/// True if the picture is the ideal image, in which the model is symmetric about the centre.
[[nodiscard]] bool is_ideal_image(const Camera& camera);
/// True if `Camera::distortion` moves points.
[[nodiscard]] bool is_distorted(const Camera& camera);
/// Maps an offset of the ideal image to the picture, by `Camera::distortion` and `affine`.
[[nodiscard]] ImageOffset distort(const Camera& camera, ImageOffset ideal);
/// Inverts `distort` by Newton steps; nullopt if they do not converge within `rim_radius_px`.
[[nodiscard]] std::optional<ImageOffset> undistort(const Camera& camera, ImageOffset offset);
/// Throws ContractError that names the field unless the map can be inverted within
/// `rim_radius_px`.
void validate_distortion(const Camera& camera);

}  // namespace panonav
