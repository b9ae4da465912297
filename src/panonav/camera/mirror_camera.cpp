#include "panonav/camera/mirror_camera.hpp"

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

/// Distances from the centre are proportional to the focal length in both models.
template <class Model>
Model scaled_to(Model model, double radius_px, double elevation_rad) {
  validate(model);
  const auto seen_at_px = radius_at(model, elevation_rad);
  require(seen_at_px.has_value() && *seen_at_px > 0, "elevation_rad", elevation_rad,
          "within the valid domain of the model, not along its axis");
  require(radius_px > 0, "radius_px", radius_px, "above 0");
  model.focal_length_px *= radius_px / *seen_at_px;
  validate(model);
  return model;
}

}  // namespace

Camera camera_from_mirror(const MirrorCircle& mirror, const MirrorKnowledge& knowledge) {
  if (std::holds_alternative<EquirectangularModel>(knowledge.model)) {
    throw ContractError("model", "equirectangular", "a model of a mirror camera");
  }
  Camera camera;
  camera.model = knowledge.model;
  camera.image_size = mirror.image_size;
  camera.centre = mirror.centre;
  camera.rim_radius_px = mirror.rim_radius_px;
  camera.inner_radius_px = knowledge.inner_radius_px.value_or(mirror.inner_radius_px.value_or(0.0));
  camera.direction = knowledge.direction;
  camera.forward_angle_rad = knowledge.forward_angle_rad;
  validate(camera);
  return camera;
}

HyperboloidalModel with_elevation_at(HyperboloidalModel model, double radius_px,
                                     double elevation_rad) {
  return scaled_to(model, radius_px, elevation_rad);
}

UnifiedModel with_elevation_at(UnifiedModel model, double radius_px, double elevation_rad) {
  return scaled_to(model, radius_px, elevation_rad);
}

}  // namespace panonav
