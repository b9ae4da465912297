#include "panonav_simulation/line_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::simulation {

namespace {

constexpr int rays_per_axis = 2;

double radius_px(const Camera& camera, PixelPoint point) {
  return std::hypot(point.u_px - camera.centre.u_px, point.v_px - camera.centre.v_px);
}

double compute_radius_px(const Camera& camera, double elevation_rad) {
  const auto point = project(camera, {std::cos(elevation_rad), 0.0, std::sin(elevation_rad)});
  if (!point) throw ContractError("the mirror camera does not see the horizon");
  return radius_px(camera, *point);
}

}  // namespace

LineCamera make_line_camera(double height_m, int columns) {
  const Camera camera = make_simulated_mirror_camera();
  const HorizonScanlineOptions line{.columns = columns};
  UnwarperOptions cylinder{.rows = 3, .columns = 2 * columns};
  cylinder.elevations = ElevationBand{-line.half_band_rad, line.half_band_rad};
  LineCamera result{camera, Unwarper(camera, cylinder), {}, line, height_m, 0.0, {}, {}};
  // Angle between neighbouring rays, by which textures are filtered.
  result.spread_rad = 1.0 / (camera.rim_radius_px * 2.0 / 3.0) / rays_per_axis;
  // Pixels at this distance are still needed, because an unwarper interpolates between neighbouring
  // pixels.
  constexpr double neighbours_px = 1.5;
  const double low = compute_radius_px(camera, -line.half_band_rad);
  const double high = compute_radius_px(camera, line.half_band_rad);
  const HyperboloidalMirror mirror(camera);
  for (int v = 0; v < camera.image_size.height; ++v) {
    for (int u = 0; u < camera.image_size.width; ++u) {
      const double radius = radius_px(camera, {u + 0.5, v + 0.5});
      if (radius < std::min(low, high) - neighbours_px ||
          radius > std::max(low, high) + neighbours_px) {
        continue;
      }
      result.pixels.push_back(static_cast<std::size_t>(v * camera.image_size.width + u));
      // Shear the grid of rays both ways, as the renderer does, so that no two rays share a row or
      // column.
      constexpr double n = rays_per_axis;
      for (int j = 0; j < rays_per_axis; ++j) {
        for (int i = 0; i < rays_per_axis; ++i) {
          result.rays.push_back(
              mirror.trace({u + (i + (j + 0.5) / n) / n, v + (j + (i + 0.5) / n) / n}));
        }
      }
    }
  }
  return result;
}

std::vector<float> capture_line(const Renderer& renderer, const Pose2& pose,
                                const LineCamera& camera, std::uint64_t seed) {
  const double c = std::cos(pose.heading_rad);
  const double s = std::sin(pose.heading_rad);
  const double height_m = renderer.ground_height_m(pose.position()) + camera.height_m;
  constexpr std::size_t rays_each = rays_per_axis * rays_per_axis;
  std::vector<float> values(camera.pixels.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t k = 0; k < rays_each; ++k) {
      const MirrorRay& ray = camera.rays[i * rays_each + k];
      const Vector3 origin{pose.x_m + c * ray.origin.x_m - s * ray.origin.y_m,
                           pose.y_m + s * ray.origin.x_m + c * ray.origin.y_m,
                           height_m + ray.origin.z_m};
      const Direction3 direction{c * ray.direction.x - s * ray.direction.y,
                                 s * ray.direction.x + c * ray.direction.y, ray.direction.z};
      values[i] += renderer.radiance_along(origin, direction, camera.spread_rad) / rays_each;
    }
  }
  const auto count = static_cast<int>(values.size());
  const Panorama seen =
      apply_sensor(Panorama(1, count, std::nullopt, std::move(values)), camera.sensor, seed);
  Image picture(camera.camera.image_size.width, camera.camera.image_size.height);
  for (std::size_t i = 0; i < camera.pixels.size(); ++i) {
    picture.pixels()[camera.pixels[i]] =
        static_cast<std::uint8_t>(std::lround(255.0F * seen.row(0)[i]));
  }
  return horizon_scanline(camera.unwarper.unwrap(picture.view()), camera.line);
}

}  // namespace panonav::simulation
