#include "panonav/route/sampler_pixels.hpp"

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

void check(const SamplerShape& shape, const ImageSize& size) {
  require(shape.rows >= 1 && shape.rows <= 255, "rows of a sampler", shape.rows, "1 .. 255");
  require(shape.azimuths >= 4 && shape.azimuths <= SamplerShape::max_azimuths,
          "azimuths of a sampler", shape.azimuths, "4 .. 64");
  require(shape.components >= 2 && 2 * shape.components <= shape.azimuths,
          "components of a sampler", shape.components,
          "2 .. " + to_text(shape.azimuths / 2) + ", half of the azimuths");
  require(shape.elevations >= 1 && shape.elevations <= 16, "elevations of a sampler",
          shape.elevations, "1 .. 16");
  constexpr double max_pixels = 65536.0;  // indices have 16 bits
  const double pixels = static_cast<double>(size.width) * size.height;
  require(pixels <= max_pixels, "pixels of a picture", pixels, "<= " + to_text(max_pixels));
}

std::uint16_t find_pixel(const Camera& camera, double azimuth_rad, double elevation_rad) {
  const auto point = project(camera, Direction3::from_angles(azimuth_rad, elevation_rad));
  require(point.has_value(), "elevation of a sample in degrees", degrees(elevation_rad),
          "one that the camera shows at every azimuth");
  const int u = std::clamp(static_cast<int>(point->u_px), 0, camera.image_size.width - 1);
  const int v = std::clamp(static_cast<int>(point->v_px), 0, camera.image_size.height - 1);
  return static_cast<std::uint16_t>(v * camera.image_size.width + u);
}

}  // namespace

std::vector<std::uint16_t> make_sampler_pixels(const Camera& camera, const ElevationBand& band,
                                               const SamplerShape& shape) {
  check(shape, camera.image_size);
  const double step_rad = (band.top_rad - band.bottom_rad) / (shape.rows * shape.elevations);
  std::vector<std::uint16_t> pixels;
  pixels.reserve(shape.samples());
  for (int row = 0; row < shape.rows; ++row) {
    for (int azimuth = 0; azimuth < shape.azimuths; ++azimuth) {
      const double azimuth_rad = 2.0 * std::numbers::pi * azimuth / shape.azimuths;
      for (int i = 0; i < shape.elevations; ++i) {
        const int from_top = row * shape.elevations + i;
        pixels.push_back(
            find_pixel(camera, azimuth_rad, band.top_rad - (from_top + 0.5) * step_rad));
      }
    }
  }
  return pixels;
}

}  // namespace panonav
