#include "panonav/camera/mirror_camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include "panonav/core/error.hpp"

namespace panonav {
namespace {

/// Scales the focal length so that the model shows `elevation_rad` at `radius_px`: in both models
/// the radius is proportional to the focal length.
template <class Model>
Model scale_focal_length(Model model, double radius_px, double elevation_rad) {
  validate(model);
  const auto current_radius_px = radius_at(model, elevation_rad);
  require(current_radius_px.has_value() && *current_radius_px > 0, "elevation_rad", elevation_rad,
          "within the valid domain of the model, not along its axis");
  require(radius_px > 0, "radius_px", radius_px, "above 0");
  model.focal_length_px *= radius_px / *current_radius_px;
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
  camera.has_assumed_elevations = knowledge.is_model_assumed;
  validate(camera);
  return camera;
}

HyperboloidalModel fit_focal_length(HyperboloidalModel model, double radius_px,
                                    double elevation_rad) {
  return scale_focal_length(model, radius_px, elevation_rad);
}

UnifiedModel fit_focal_length(UnifiedModel model, double radius_px, double elevation_rad) {
  return scale_focal_length(model, radius_px, elevation_rad);
}

namespace {

using Colour = std::array<double, 3>;
constexpr Colour green{0, 230, 60};
constexpr Colour orange{255, 140, 0};
constexpr Colour red{255, 30, 30};
constexpr Colour yellow{255, 230, 0};

/// Blends a colour into a pixel by the share that a line at this distance and of this half width
/// covers.
void blend_line_pixel(Image& image, int u, int v, const Colour& colour, double distance_px,
                      double half_width_px) {
  const double coverage = std::clamp(half_width_px + 0.5 - distance_px, 0.0, 1.0);
  if (coverage == 0) return;
  for (int c = 0; c < 3; ++c) {
    const double mixed = (1 - coverage) * image.at(u, v, c) + coverage * colour[c];
    image.at(u, v, c) = static_cast<std::uint8_t>(std::lround(mixed));
  }
}

}  // namespace

Image draw_mirror(ImageView image, const MirrorCircle& mirror,
                  std::optional<double> forward_angle_rad) {
  require(image.width == mirror.image_size.width, "image width", image.width,
          to_text(mirror.image_size.width));
  require(image.height == mirror.image_size.height, "image height", image.height,
          to_text(mirror.image_size.height));
  Image picture(image.width, image.height, 3);
  // Widens lines in large images, so that they remain visible when the image is scaled down to a
  // screen.
  const double half_width_px = std::max(0.5, std::max(image.width, image.height) / 1600.0);
  const double cross_px = std::max(4.0, 0.06 * mirror.rim_radius_px);
  const double inner_px = mirror.inner_radius_px.value_or(0.0);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      for (int c = 0; c < 3; ++c)
        picture.at(u, v, c) = image.at(u, v, std::min(c, image.channels - 1));
      const double x = u + 0.5 - mirror.centre.u_px;
      const double y = v + 0.5 - mirror.centre.v_px;
      const double r = std::hypot(x, y);
      blend_line_pixel(picture, u, v, green, std::abs(r - mirror.rim_radius_px), half_width_px);
      if (mirror.inner_radius_px) {
        blend_line_pixel(picture, u, v, orange, std::abs(r - inner_px), half_width_px);
      }
      if (std::max(std::abs(x), std::abs(y)) <= cross_px) {
        blend_line_pixel(picture, u, v, red, std::min(std::abs(x), std::abs(y)), half_width_px);
      }
      if (forward_angle_rad) {
        const double along = x * std::cos(*forward_angle_rad) - y * std::sin(*forward_angle_rad);
        const double across = x * std::sin(*forward_angle_rad) + y * std::cos(*forward_angle_rad);
        if (along >= inner_px && along <= mirror.rim_radius_px) {
          blend_line_pixel(picture, u, v, yellow, std::abs(across), half_width_px);
        }
      }
    }
  }
  return picture;
}

}  // namespace panonav
