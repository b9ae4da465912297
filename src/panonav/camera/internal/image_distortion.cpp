#include "panonav/camera/internal/image_distortion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"

namespace panonav {
namespace {

/// A point of the normalised plane, or a 2 x 2 Jacobian row by row.
struct Plane {
  double x = 0.0;
  double y = 0.0;
};
struct Jacobian {
  double xx = 1.0, xy = 0.0, yx = 0.0, yy = 1.0;
};

/// Returns the distorted point of OpenCV's model and its derivative.
std::pair<Plane, Jacobian> distort_plane(const std::array<double, 5>& k, Plane p) {
  const auto [k1, k2, p1, p2, k3] = k;
  const double r2 = p.x * p.x + p.y * p.y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2));  // of `radial`, by r2, twice
  const Plane distorted{p.x * radial + 2 * p1 * p.x * p.y + p2 * (r2 + 2 * p.x * p.x),
                        p.y * radial + p1 * (r2 + 2 * p.y * p.y) + 2 * p2 * p.x * p.y};
  const double mixed = slope * p.x * p.y + 2 * p1 * p.x + 2 * p2 * p.y;
  return {distorted,
          {radial + slope * p.x * p.x + 2 * p1 * p.y + 6 * p2 * p.x, mixed, mixed,
           radial + slope * p.y * p.y + 6 * p1 * p.y + 2 * p2 * p.x}};
}

double normalising_length_px(const Camera& camera) {
  if (const auto* unified = std::get_if<UnifiedModel>(&camera.model)) {
    return unified->focal_length_px;
  }
  const auto* pinhole = std::get_if<PinholeModel>(&camera.model);
  return pinhole == nullptr ? 1.0 : pinhole->focal_length_px;
}

}  // namespace

bool is_distorted(const Camera& camera) {
  return std::ranges::any_of(camera.distortion, [](double k) { return k != 0.0; });
}

bool is_ideal_image(const Camera& camera) {
  return camera.affine == Camera{}.affine && !is_distorted(camera);
}

ImageOffset distort(const Camera& camera, ImageOffset ideal) {
  if (is_distorted(camera)) {
    const double f = normalising_length_px(camera);
    const Plane p = distort_plane(camera.distortion, {ideal.right_px / f, ideal.down_px / f}).first;
    ideal = {f * p.x, f * p.y};
  }
  const auto [c, d, e] = camera.affine;
  return {ideal.right_px + e * ideal.down_px, c * ideal.down_px + d * ideal.right_px};
}

std::optional<ImageOffset> undistort(const Camera& camera, ImageOffset offset) {
  constexpr int max_steps = 50;
  constexpr double tolerance = 1e-13;
  constexpr double max_step = 0.5;  // keeps the steps on the near side of a fold
  const auto [c, d, e] = camera.affine;
  const double determinant = c - d * e;
  const ImageOffset plane{(c * offset.right_px - e * offset.down_px) / determinant,
                          (offset.down_px - d * offset.right_px) / determinant};
  if (!is_distorted(camera)) return plane;
  const double f = normalising_length_px(camera);
  const Plane target{plane.right_px / f, plane.down_px / f};
  const double rim = camera.rim_radius_px / f;
  Plane p = target;
  const double start = std::hypot(p.x, p.y);
  if (start > rim) p = {p.x * rim / start, p.y * rim / start};
  for (int i = 0; i < max_steps; ++i) {
    const auto [distorted, j] = distort_plane(camera.distortion, p);
    const double det = j.xx * j.yy - j.xy * j.yx;
    const double ex = target.x - distorted.x;
    const double ey = target.y - distorted.y;
    Plane step{(j.yy * ex - j.xy * ey) / det, (j.xx * ey - j.yx * ex) / det};
    const double length = std::hypot(step.x, step.y);
    if (!std::isfinite(length)) return std::nullopt;
    if (length > max_step) step = {step.x * max_step / length, step.y * max_step / length};
    p = {p.x + step.x, p.y + step.y};
    if (length <= tolerance) {
      if (std::hypot(p.x, p.y) > rim * (1 + 1e-9)) return std::nullopt;
      return ImageOffset{f * p.x, f * p.y};
    }
  }
  return std::nullopt;
}

void validate_distortion(const Camera& camera) {
  for (const double value : camera.affine) require(std::isfinite(value), "affine", value, "finite");
  const auto [c, d, e] = camera.affine;
  require(c - d * e > 0.1 && c < 10.0, "affine", c, "three numbers c, d, e with c - d e above 0.1");
  if (!is_distorted(camera)) return;
  require(std::holds_alternative<UnifiedModel>(camera.model) ||
              std::holds_alternative<PinholeModel>(camera.model),
          "distortion", camera.distortion[0], "zero, unless the model is unified or pinhole");
  require(std::isfinite(camera.rim_radius_px) && camera.rim_radius_px > 0, "rim_radius_px",
          camera.rim_radius_px, "finite and above 0 with a distortion");
  constexpr int radii = 64;
  constexpr int azimuths = 16;
  const double rim = camera.rim_radius_px / normalising_length_px(camera);
  for (int i = 1; i <= radii; ++i) {
    for (int a = 0; a < azimuths; ++a) {
      const double r = rim * i / radii;
      const double angle = 2.0 * std::numbers::pi * a / azimuths;
      const Jacobian j =
          distort_plane(camera.distortion, {r * std::cos(angle), r * std::sin(angle)}).second;
      if (j.xx * j.yy - j.xy * j.yx > 0 && j.xx + j.yy > 0) continue;
      throw ContractError("distortion: it folds the image at the radius",
                          to_general_text(r * normalising_length_px(camera), 6) + " px",
                          "beyond rim_radius_px");
    }
  }
}

}  // namespace panonav
