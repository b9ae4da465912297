#include "panonav/camera/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/camera/internal/image_distortion.hpp"
#include "panonav/core/error.hpp"

namespace panonav {
namespace {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;  // clang 14 does not find it

/// Tolerance for rounding errors at the borders of the domain, relative to the longer side of the
/// image.
constexpr double border_tolerance = 1e-9;

double tolerance_px(const Camera& camera) {
  return border_tolerance * std::max(camera.image_size.width, camera.image_size.height);
}

/// Clamps to [low, high]; nullopt if the value is outside by more than the tolerance, or NaN.
std::optional<double> clamp_with_tolerance(double value, double low, double high,
                                           double tolerance) {
  if (!(value >= low - tolerance && value <= high + tolerance)) return std::nullopt;
  return std::clamp(value, low, high);
}

std::optional<PixelPoint> clamp_to_image(const Camera& camera, PixelPoint pixel) {
  const double tolerance = tolerance_px(camera);
  const auto u = clamp_with_tolerance(pixel.u_px, 0, camera.image_size.width, tolerance);
  const auto v = clamp_with_tolerance(pixel.v_px, 0, camera.image_size.height, tolerance);
  if (!u || !v) return std::nullopt;
  return PixelPoint{*u, *v};
}

/// Returns the elevation shown at a distance from the centre; nullopt outside [inner, rim] and for
/// cameras without a mirror model.
std::optional<double> elevation_at(const Camera& camera, double radius_px) {
  const auto r = clamp_with_tolerance(radius_px, camera.inner_radius_px, camera.rim_radius_px,
                                      tolerance_px(camera));
  if (!r) return std::nullopt;
  return std::visit(
      Overloaded{[&](const EquiangularModel& model) -> std::optional<double> {
                   return panonav::elevation_at(model, *r, camera.inner_radius_px,
                                                camera.rim_radius_px);
                 },
                 [](const EquirectangularModel&) -> std::optional<double> { return std::nullopt; },
                 [](const DualFisheyeModel&) -> std::optional<double> { return std::nullopt; },
                 [](const PinholeModel&) -> std::optional<double> { return std::nullopt; },
                 [](const RigModel&) -> std::optional<double> { return std::nullopt; },
                 [&](const auto& model) { return panonav::elevation_at(model, *r); }},
      camera.model);
}

/// Returns the distance from the centre within [inner, rim] at which a mirror shows an elevation.
std::optional<double> radius_at(const Camera& camera, double elevation_rad) {
  const double inner_px = camera.inner_radius_px;
  const double rim_px = camera.rim_radius_px;
  const double slack_px = tolerance_px(camera);
  const std::optional<double> r = std::visit(
      Overloaded{[&](const EquiangularModel& model) -> std::optional<double> {
                   return panonav::radius_at(model, elevation_rad, inner_px, rim_px);
                 },
                 [](const EquirectangularModel&) -> std::optional<double> { return std::nullopt; },
                 [](const DualFisheyeModel&) -> std::optional<double> { return std::nullopt; },
                 [](const PinholeModel&) -> std::optional<double> { return std::nullopt; },
                 [](const RigModel&) -> std::optional<double> { return std::nullopt; },
                 [&](const PolynomialModel& model) {
                   return panonav::radius_at(model, elevation_rad,
                                             std::max(0.0, inner_px - slack_px), rim_px + slack_px);
                 },
                 [&](const auto& model) { return panonav::radius_at(model, elevation_rad); }},
      camera.model);
  if (!r) return std::nullopt;
  return clamp_with_tolerance(*r, inner_px, rim_px, slack_px);
}

void validate_centre(const Camera& camera) {
  const auto [width, height] = camera.image_size;
  require(camera.centre.u_px >= 0 && camera.centre.u_px <= width, "centre.u_px", camera.centre.u_px,
          "0 .. " + to_text(width));
  require(camera.centre.v_px >= 0 && camera.centre.v_px <= height, "centre.v_px",
          camera.centre.v_px, "0 .. " + to_text(height));
}

void validate_mirror(const Camera& camera) {
  validate_centre(camera);
  require(std::isfinite(camera.inner_radius_px) && camera.inner_radius_px >= 0, "inner_radius_px",
          camera.inner_radius_px, "finite and at least 0");
  require(std::isfinite(camera.rim_radius_px) && camera.rim_radius_px > camera.inner_radius_px,
          "rim_radius_px", camera.rim_radius_px,
          "finite and above inner_radius_px " + to_text(camera.inner_radius_px));
  require(std::isfinite(camera.forward_angle_rad), "forward_angle_rad", camera.forward_angle_rad,
          "finite");
  std::visit(
      Overloaded{[&](const PolynomialModel& model) {
                   validate(model, camera.inner_radius_px, camera.rim_radius_px);
                 },
                 [](const EquirectangularModel&) {}, [](const auto& model) { validate(model); }},
      camera.model);
  validate_distortion(camera);
  require(elevation_at(camera, camera.rim_radius_px).has_value(), "rim_radius_px",
          camera.rim_radius_px, "within the valid domain of the camera's model");
}

void validate_dual(const Camera& camera, const DualFisheyeModel& model) {
  validate(model);
  const auto [width, height] = camera.image_size;
  for (int i = 0; i < 2; ++i) {
    const FisheyeLens& lens = model.lenses[i];
    const double left = 0.5 * width * i;
    const std::string name = "lens" + std::to_string(i);
    require(lens.centre_u_px >= left && lens.centre_u_px <= left + 0.5 * width,
            name + "_centre_u_px", lens.centre_u_px,
            to_text(left) + " .. " + to_text(left + 0.5 * width));
    require(lens.centre_v_px >= 0 && lens.centre_v_px <= height, name + "_centre_v_px",
            lens.centre_v_px, "0 .. " + to_text(height));
  }
}

/// Returns +1 if the image shows the lens's picture unmirrored, else -1.
double mirror_sign(const Camera& camera) {
  return camera.direction == ColumnDirection::clockwise ? 1.0 : -1.0;
}

struct LensProjection {
  PixelPoint pixel;
  double margin_rad = 0.0;
};
std::optional<LensProjection> project_into_lens(const Camera& camera, const DualFisheyeModel& model,
                                                int index, const Direction3& direction) {
  const FisheyeLens& lens = model.lenses[index];
  const auto point = project(lens, FisheyeLens::Rotation(lens).lens_from_robot(direction));
  if (!point) return std::nullopt;
  const auto pixel = clamp_to_image(
      camera,
      {lens.centre_u_px + mirror_sign(camera) * point->right_px, lens.centre_v_px - point->up_px});
  if (!pixel || lens_at(camera, *pixel) != index) return std::nullopt;
  return LensProjection{*pixel, point->margin_rad};
}

/// Finds the largest band around the horizon in which every direction of a grid of 2 x 1 degrees is
/// visible.
ElevationBand visible_elevations_of_lenses(const Camera& camera) {
  constexpr int azimuths = 180;
  constexpr int elevations = 90;
  const auto is_visible_all_around = [&](double elevation_rad) {
    for (int i = 0; i < azimuths; ++i) {
      const auto direction =
          Direction3::from_angles(2 * std::numbers::pi * i / azimuths, elevation_rad);
      if (!project(camera, direction)) return false;
    }
    return true;
  };
  require(is_visible_all_around(0), "elevation seen at every azimuth", 0.0,
          std::holds_alternative<RigModel>(camera.model)
              ? "seen by one of the cameras"
              : "seen by one of the lenses; max_angle_rad is too small or the frame cuts the "
                "circles");
  const double step = std::numbers::pi / 2 / elevations;
  ElevationBand band;
  for (int i = 1; i <= elevations && is_visible_all_around(i * step); ++i) band.top_rad = i * step;
  for (int i = 1; i <= elevations && is_visible_all_around(-i * step); ++i)
    band.bottom_rad = -i * step;
  require(band.top_rad > band.bottom_rad, "elevations seen at every azimuth", 0.0, "a band");
  return band;
}

void validate_rig(const Camera& camera, const RigModel& model) {
  validate(model);
  const ImageSize size = find_picture_size(model);
  require(camera.image_size.width == size.width, "image_size.width", camera.image_size.width,
          to_text(size.width) + ", the sum of its cameras'");
  require(camera.image_size.height == size.height, "image_size.height", camera.image_size.height,
          to_text(size.height) + ", the largest of its cameras'");
  require(camera.direction == ColumnDirection::clockwise, "columns", 1.0,
          "clockwise: pictures of a rig are not mirrored");
}

void validate_equirectangular(const Camera& camera, const EquirectangularModel& model) {
  require(std::abs(model.elevation_bottom_rad) <= std::numbers::pi / 2, "elevation_bottom_rad",
          model.elevation_bottom_rad, "-pi/2 .. pi/2");
  require(model.elevation_top_rad > model.elevation_bottom_rad &&
              model.elevation_top_rad <= std::numbers::pi / 2,
          "elevation_top_rad", model.elevation_top_rad, "above elevation_bottom_rad, at most pi/2");
  require(camera.forward_column >= 0 && camera.forward_column <= 1, "forward_column",
          camera.forward_column, "0 .. 1");
}

}  // namespace

void validate(const Camera& camera) {
  require(camera.image_size.width >= 1, "image_size.width", camera.image_size.width, "at least 1");
  require(camera.image_size.height >= 1, "image_size.height", camera.image_size.height,
          "at least 1");
  if (const auto* model = std::get_if<EquirectangularModel>(&camera.model)) {
    validate_equirectangular(camera, *model);
  } else if (const auto* dual = std::get_if<DualFisheyeModel>(&camera.model)) {
    validate_dual(camera, *dual);
  } else if (const auto* pinhole = std::get_if<PinholeModel>(&camera.model)) {
    validate(*pinhole);
    validate_centre(camera);
    require(camera.direction == ColumnDirection::clockwise, "columns", 1.0,
            "clockwise: pictures of a pinhole lens are not mirrored");
    validate_distortion(camera);
  } else if (const auto* rig = std::get_if<RigModel>(&camera.model)) {
    validate_rig(camera, *rig);
  } else {
    validate_mirror(camera);
  }
}

std::optional<PixelPoint> project(const Camera& camera, const Direction3& direction) {
  const double length = std::hypot(direction.x, direction.y, direction.z);
  if (!std::isfinite(length) || length == 0) return std::nullopt;
  const double azimuth_rad = direction.azimuth_rad();
  const double elevation_rad = direction.elevation_rad();
  if (const auto* model = std::get_if<EquirectangularModel>(&camera.model)) {
    const double height = camera.image_size.height;
    const double width = camera.image_size.width;
    const double v_px = (model->elevation_top_rad - elevation_rad) /
                        (model->elevation_top_rad - model->elevation_bottom_rad) * height;
    const auto v = clamp_with_tolerance(v_px, 0, height, tolerance_px(camera));
    if (!v) return std::nullopt;
    double turns = camera.forward_column +
                   azimuth_sign(camera.direction) * azimuth_rad / (2 * std::numbers::pi);
    turns -= std::floor(turns);
    const double u_px = turns * width;
    return PixelPoint{u_px < width ? u_px : 0.0, *v};
  }
  if (lens_count(camera) == 2) {
    const auto [first, second] = project_all(camera, direction);
    if (!first && !second) return std::nullopt;
    return second && (!first || second->weight > first->weight) ? second->pixel : first->pixel;
  }
  if (const auto* rig = std::get_if<RigModel>(&camera.model)) return project(*rig, direction);
  if (const auto* model = std::get_if<PinholeModel>(&camera.model)) {
    return project_from_lens(camera, *model, find_rotation(*model).lens_from_robot(direction));
  }
  const auto radius_px = radius_at(camera, elevation_rad);
  if (!radius_px) return std::nullopt;
  const double angle_rad = camera.forward_angle_rad + azimuth_sign(camera.direction) * azimuth_rad;
  const ImageOffset offset =
      distort(camera, {*radius_px * std::cos(angle_rad), -*radius_px * std::sin(angle_rad)});
  return clamp_to_image(
      camera, {camera.centre.u_px + offset.right_px, camera.centre.v_px + offset.down_px});
}

namespace {

/// True if a distorted pinhole lens shows nothing at an offset of the ideal image.
bool is_beyond_rim(const Camera& camera, const ImageOffset& ideal) {
  return is_distorted(camera) &&
         std::hypot(ideal.right_px, ideal.down_px) > camera.rim_radius_px + tolerance_px(camera);
}

}  // namespace

std::optional<PixelPoint> project_from_lens(const Camera& camera, const PinholeModel& model,
                                            const Direction3& in_lens) {
  const auto offset = project(model, in_lens);
  if (!offset) return std::nullopt;
  ImageOffset seen{offset->right_px, -offset->up_px};
  if (!is_ideal_image(camera)) {
    if (is_beyond_rim(camera, seen)) return std::nullopt;
    seen = distort(camera, seen);
  }
  return clamp_to_image(camera,
                        {camera.centre.u_px + seen.right_px, camera.centre.v_px + seen.down_px});
}

std::optional<Direction3> unproject(const Camera& camera, PixelPoint pixel) {
  const auto inside = clamp_to_image(camera, pixel);
  if (!inside) return std::nullopt;
  if (const auto* model = std::get_if<EquirectangularModel>(&camera.model)) {
    const double t = inside->v_px / camera.image_size.height;
    const double elevation_rad =
        model->elevation_top_rad * (1 - t) + model->elevation_bottom_rad * t;
    const double turns = inside->u_px / camera.image_size.width - camera.forward_column;
    return Direction3::from_angles(azimuth_sign(camera.direction) * turns * 2 * std::numbers::pi,
                                   elevation_rad);
  }
  if (const auto* model = std::get_if<DualFisheyeModel>(&camera.model)) {
    const FisheyeLens& lens = model->lenses[static_cast<std::size_t>(lens_at(camera, *inside))];
    const auto in_lens = unproject(lens, mirror_sign(camera) * (inside->u_px - lens.centre_u_px),
                                   lens.centre_v_px - inside->v_px);
    if (!in_lens) return std::nullopt;
    return FisheyeLens::Rotation(lens).robot_from_lens(*in_lens);
  }
  if (const auto* rig = std::get_if<RigModel>(&camera.model)) {
    return panonav::unproject(*rig, *inside);
  }
  if (const auto* model = std::get_if<PinholeModel>(&camera.model)) {
    const auto ideal =
        undistort(camera, {inside->u_px - camera.centre.u_px, inside->v_px - camera.centre.v_px});
    if (!ideal || is_beyond_rim(camera, *ideal)) return std::nullopt;
    return panonav::unproject(*model, ideal->right_px, -ideal->down_px);
  }
  const auto ideal =
      undistort(camera, {inside->u_px - camera.centre.u_px, inside->v_px - camera.centre.v_px});
  if (!ideal) return std::nullopt;
  const auto elevation_rad = elevation_at(camera, std::hypot(ideal->right_px, ideal->down_px));
  if (!elevation_rad) return std::nullopt;
  const double angle_rad = std::atan2(-ideal->down_px, ideal->right_px);
  return Direction3::from_angles(
      azimuth_sign(camera.direction) * (angle_rad - camera.forward_angle_rad), *elevation_rad);
}

std::array<std::optional<Camera::WeightedPixel>, 2> project_all(const Camera& camera,
                                                                const Direction3& direction) {
  std::array<std::optional<Camera::WeightedPixel>, 2> result;
  const auto* model = std::get_if<DualFisheyeModel>(&camera.model);
  if (model == nullptr) {
    if (const auto pixel = project(camera, direction))
      result[0] = Camera::WeightedPixel{*pixel, 1.0};
    return result;
  }
  const double length = std::hypot(direction.x, direction.y, direction.z);
  if (!std::isfinite(length) || length == 0) return result;
  const auto first = project_into_lens(camera, *model, 0, direction);
  const auto second = project_into_lens(camera, *model, 1, direction);
  const double share = !second  ? 1.0
                       : !first ? 0.0
                                : blend_share(first->margin_rad, second->margin_rad);
  if (first) result[0] = Camera::WeightedPixel{first->pixel, share};
  if (second) result[1] = Camera::WeightedPixel{second->pixel, 1.0 - share};
  return result;
}

bool has_vertical_axis(const Camera& camera) {
  return !std::holds_alternative<EquirectangularModel>(camera.model) &&
         !std::holds_alternative<DualFisheyeModel>(camera.model) &&
         !std::holds_alternative<PinholeModel>(camera.model) &&
         !std::holds_alternative<RigModel>(camera.model);
}

namespace {

/// Returns the number of degrees of azimuth at which a rig shows the horizon.
int count_seen_degrees(const Camera& camera) {
  int seen = 0;
  for (int i = 0; i < 360; ++i) {
    if (project(camera, Direction3::from_angles(i * std::numbers::pi / 180, 0.0))) ++seen;
  }
  return seen;
}

}  // namespace

bool has_pinhole_lenses(const Camera& camera) {
  return std::holds_alternative<PinholeModel>(camera.model) ||
         std::holds_alternative<RigModel>(camera.model);
}

bool shows_all_azimuths(const Camera& camera) {
  return std::holds_alternative<RigModel>(camera.model)
             ? count_seen_degrees(camera) == 360
             : !std::holds_alternative<PinholeModel>(camera.model);
}

double field_of_view(const Camera& camera) {
  if (std::holds_alternative<RigModel>(camera.model)) {
    return count_seen_degrees(camera) * std::numbers::pi / 180;
  }
  if (!std::holds_alternative<PinholeModel>(camera.model)) return 0.0;
  const auto find = [&](double u_px) { return unproject(camera, {u_px, camera.centre.v_px}); };
  double left_px = 0.0;
  double right_px = camera.image_size.width;
  while (left_px < camera.centre.u_px && !find(left_px)) left_px += 1.0;
  while (right_px > camera.centre.u_px && !find(right_px)) right_px -= 1.0;
  const auto left = find(left_px);
  const auto right = find(right_px);
  if (!left || !right) return 0.0;
  return std::acos(
      std::clamp(left->x * right->x + left->y * right->y + left->z * right->z, -1.0, 1.0));
}

ImageCircle image_circle(const Camera& camera, int lens) {
  if (const auto* model = std::get_if<DualFisheyeModel>(&camera.model)) {
    const FisheyeLens& fisheye = model->lenses[lens];
    return {
        {fisheye.centre_u_px, fisheye.centre_v_px}, 0.0, radius_at(fisheye, fisheye.max_angle_rad)};
  }
  if (!has_vertical_axis(camera)) return {};
  if (is_ideal_image(camera)) return {camera.centre, camera.inner_radius_px, camera.rim_radius_px};
  ImageCircle circle{camera.centre, camera.inner_radius_px, 0.0};
  constexpr int azimuths = 64;
  for (int i = 0; i < azimuths; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / azimuths;
    const ImageOffset rim = distort(camera, {camera.rim_radius_px * std::cos(angle_rad),
                                             camera.rim_radius_px * std::sin(angle_rad)});
    circle.rim_radius_px = std::max(circle.rim_radius_px, std::hypot(rim.right_px, rim.down_px));
  }
  return circle;
}

namespace {

/// Returns the radius of the largest circle of the ideal image, up to the rim, that lies within the
/// picture.
double find_outer_radius(const Camera& camera) {
  const auto [width, height] = camera.image_size;
  const auto [u_px, v_px] = camera.centre;
  if (is_ideal_image(camera)) {
    return std::min({camera.rim_radius_px, u_px, width - u_px, v_px, height - v_px});
  }
  constexpr int azimuths = 720;
  constexpr int bisections = 40;
  constexpr double between_azimuths = 1 - 2e-5;  // what a straight edge cuts off between two
  double outer_px = camera.rim_radius_px;
  for (int i = 0; i < azimuths; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / azimuths;
    const auto is_inside = [&](double radius_px) {
      const ImageOffset at =
          distort(camera, {radius_px * std::cos(angle_rad), radius_px * std::sin(angle_rad)});
      const PixelPoint pixel{camera.centre.u_px + at.right_px, camera.centre.v_px + at.down_px};
      return pixel.u_px >= 0 && pixel.u_px <= camera.image_size.width && pixel.v_px >= 0 &&
             pixel.v_px <= camera.image_size.height;
    };
    if (is_inside(outer_px)) continue;
    double low = 0.0;
    for (int k = 0; k < bisections; ++k) {
      const double middle = 0.5 * (low + outer_px);
      (is_inside(middle) ? low : outer_px) = middle;
    }
    outer_px = low;
  }
  return outer_px < camera.rim_radius_px ? between_azimuths * outer_px : outer_px;
}

}  // namespace

ElevationBand visible_elevations(const Camera& camera) {
  if (const auto* model = std::get_if<EquirectangularModel>(&camera.model)) {
    return {model->elevation_bottom_rad, model->elevation_top_rad};
  }
  if (lens_count(camera) == 2 || std::holds_alternative<RigModel>(camera.model)) {
    return visible_elevations_of_lenses(camera);
  }
  if (std::holds_alternative<PinholeModel>(camera.model)) {
    throw ContractError("model", "pinhole", "one that shows all azimuths");
  }
  const double outer_px = find_outer_radius(camera);
  require(outer_px > camera.inner_radius_px, "distance from the centre to the frame", outer_px,
          "above inner_radius_px " + to_text(camera.inner_radius_px));
  const double at_inner_rad = elevation_at(camera, camera.inner_radius_px).value();
  const double at_outer_rad = elevation_at(camera, outer_px).value();
  return {std::min(at_inner_rad, at_outer_rad), std::max(at_inner_rad, at_outer_rad)};
}

}  // namespace panonav
