#include "panonav_simulation/mirror.hpp"

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::simulation {

HyperboloidalMirror::HyperboloidalMirror(const Camera& camera) : camera_(camera) {
  validate(camera);
  const auto* const model = std::get_if<HyperboloidalModel>(&camera.model);
  if (model == nullptr) {
    throw ContractError("camera model", "not hyperboloidal", "hyperboloidal, to trace its mirror");
  }
  model_ = *model;
  focus_mm_ = std::hypot(model_.a_mm, model_.b_mm);
  Point point{};
  if (!reflect(camera.rim_radius_px, point)) {
    throw ContractError("rim_radius_px", camera.rim_radius_px,
                        "less than focal_length_px * a_mm / b_mm, where the mirror's image ends");
  }
  rim_radius_mm_ = point.radius_mm;
  if (camera.inner_radius_px > 0.0 && reflect(camera.inner_radius_px, point) &&
      point.direction_z < 0.0) {
    // The body is a disc around the lens, just large enough to fill the inner radius of the image.
    const double height_above_lens_mm = point.height_mm + focus_mm_;
    body_radius_mm_ =
        point.radius_mm - height_above_lens_mm * point.direction_r / point.direction_z;
  }
}

bool HyperboloidalMirror::reflect(double radius_px, Point& point) const {
  // A ray from the lens (0, -c) along (r, f) meets R^2 / a^2 - Z^2 / b^2 = -1 where p t^2 + q t -
  // a^2 / b^2 = 0. The larger root is on the upper sheet, which is the mirror.
  const double a2 = model_.a_mm * model_.a_mm;
  const double b2 = model_.b_mm * model_.b_mm;
  const double f = model_.focal_length_px;
  const double p = radius_px * radius_px / a2 - f * f / b2;
  const double q = 2.0 * f * focus_mm_ / b2;
  if (!(p < 0.0)) return false;
  const double root = std::sqrt(q * q + 4.0 * p * a2 / b2);
  const double t = (-q - root) / (2.0 * p);
  point.radius_mm = t * radius_px;
  point.height_mm = t * f - focus_mm_;
  // The surface normal is the normalised gradient, on the side of the lens.
  double normal_r = point.radius_mm / a2;
  double normal_z = -point.height_mm / b2;
  const double normal_length = std::hypot(normal_r, normal_z);
  normal_r /= normal_length;
  normal_z /= normal_length;
  const double length = std::hypot(radius_px, f);
  const double in_r = radius_px / length;
  const double in_z = f / length;
  const double along_normal = in_r * normal_r + in_z * normal_z;
  point.direction_r = in_r - 2.0 * along_normal * normal_r;
  point.direction_z = in_z - 2.0 * along_normal * normal_z;
  return true;
}

MirrorRay HyperboloidalMirror::trace(PixelPoint pixel) const {
  const double right_px = pixel.u_px - camera_.centre.u_px;
  const double up_px = camera_.centre.v_px - pixel.v_px;
  MirrorRay ray;
  Point point{};
  if (!reflect(std::hypot(right_px, up_px), point) || point.radius_mm > rim_radius_mm_) return ray;
  const double azimuth =
      azimuth_sign(camera_.direction) * (std::atan2(up_px, right_px) - camera_.forward_angle_rad);
  const double c = std::cos(azimuth);
  const double s = std::sin(azimuth);
  ray.origin = {1e-3 * point.radius_mm * c, 1e-3 * point.radius_mm * s,
                1e-3 * (point.height_mm - focus_mm_)};
  ray.direction = {point.direction_r * c, point.direction_r * s, point.direction_z};
  ray.target = MirrorTarget::world;
  if (point.direction_z < 0.0 && body_radius_mm_ > 0.0) {
    const double height_above_lens_mm = point.height_mm + focus_mm_;
    const double at_lens_mm =
        point.radius_mm - height_above_lens_mm * point.direction_r / point.direction_z;
    if (at_lens_mm <= body_radius_mm_) {
      ray.target = MirrorTarget::camera_body;
      ray.body_radius = at_lens_mm / body_radius_mm_;
    }
  }
  return ray;
}

Camera make_simulated_mirror_camera() {
  Camera camera;
  camera.model = HyperboloidalModel{9.365, 7.804, 320.0};
  camera.image_size = {640, 480};
  camera.centre = {320.0, 240.0};
  camera.rim_radius_px = 228.0;
  camera.inner_radius_px = 40.0;
  return camera;
}

Camera make_simulated_dual_fisheye(std::uint64_t lens_seed, double baseline_m) {
  Camera camera;
  camera.image_size = {1280, 640};
  DualFisheyeModel model;
  model.baseline_m = baseline_m;
  Random random(lens_seed);
  const double size = lens_seed == 0 ? 0.0 : 1.0;
  const auto error = [&](double largest) { return size * random.uniform(-largest, largest); };
  for (int i = 0; i < 2; ++i) {
    FisheyeLens& lens = model.lenses[static_cast<std::size_t>(i)];
    lens.centre_u_px = 320.0 + 640.0 * i + error(5.0);
    lens.centre_v_px = 320.0 + error(5.0);
    lens.focal_length_px = 180.0 * (1.0 + error(0.025));
    lens.k3 = error(0.01);
    lens.k5 = error(0.002);
    lens.azimuth_rad = std::numbers::pi * i + error(radians(2.0));
    lens.elevation_rad = error(radians(2.0));
    lens.roll_rad = error(radians(2.0));
  }
  model.lenses[random.index(2)].gain = 1.0 - std::abs(error(0.2));
  camera.model = model;
  return camera;
}

}  // namespace panonav::simulation
