#include "lab/m04/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav::lab {

namespace {

constexpr double sector_rad = 2.0 * std::numbers::pi / shape_directions;

}  // namespace

std::size_t find_sector(double azimuth_rad) {
  const auto steps = std::lround(azimuth_rad / sector_rad);
  constexpr long count = shape_directions;
  return static_cast<std::size_t>(((steps % count) + count) % count);
}

Surroundings measure_surroundings(const simulation::PlaceRecording& place, Point2 position) {
  constexpr std::size_t ray_count = 120;
  constexpr std::array heights_m{0.3, 0.6, 0.9};
  Surroundings result;
  Directional inverse_distance_sums{};
  Directional rays{};
  Directional shift{};
  for (std::size_t ray = 0; ray < ray_count; ++ray) {
    const double azimuth = 2.0 * std::numbers::pi * static_cast<double>(ray) / ray_count;
    for (const double height : heights_m) {
      const double free_m = place.renderer->distance_along({position.x_m, position.y_m, height},
                                                           Direction3::from_angles(azimuth, 0.0));
      const double inverse_distance = std::isfinite(free_m) ? 1.0 / std::max(free_m, 0.01) : 0.0;
      const std::size_t sector = find_sector(azimuth);
      inverse_distance_sums[sector] += inverse_distance;
      rays[sector] += 1.0;
      for (std::size_t direction = 0; direction < shape_directions; ++direction) {
        const double theta = sector_rad * static_cast<double>(direction);
        shift[direction] += std::abs(std::sin(azimuth - theta)) * inverse_distance;
      }
    }
  }
  for (std::size_t i = 0; i < shape_directions; ++i) {
    // Distance used where all rays meet nothing, as outdoors; larger than any room.
    constexpr double far_m = 1000.0;
    result.free_m[i] = inverse_distance_sums[i] > 0.0 ? rays[i] / inverse_distance_sums[i] : far_m;
    result.parallax_m[i] =
        shift[i] > 0.0 ? static_cast<double>(ray_count * heights_m.size()) / shift[i] : far_m;
  }
  return result;
}

Directional predict_extents(const simulation::PlaceRecording& place, const Pose2& pose,
                            const Panorama& view, int components) {
  require(view.elevations().has_value(), "elevations of the view", 0.0, "known");
  using Complex = std::complex<double>;
  const FourierSignature signature = compute_signature(view, components);
  const double column_rad = 2.0 * std::numbers::pi / view.columns();
  const double row_rad = (view.elevations()->top_rad - view.elevations()->bottom_rad) / view.rows();
  const auto count = static_cast<std::size_t>(components);
  Directional change{};
  for (int y = 0; y < view.rows(); ++y) {
    const double elevation = view.elevation_rad(y);
    const int above = std::max(y - 1, 0);
    const int below = std::min(y + 1, view.rows() - 1);
    // Change of this row's components per metre of robot motion along x and along y.
    std::vector<Complex> along_x(count);
    std::vector<Complex> along_y(count);
    for (int c = 0; c < view.columns(); ++c) {
      const double azimuth = view.azimuth_rad(c);
      const double range_m = place.renderer->distance_along(
          {pose.x_m, pose.y_m, place.scene.camera_height_m},
          Direction3::from_angles(azimuth + pose.heading_rad, elevation));
      if (!std::isfinite(range_m) || range_m <= 0.0) continue;
      const int left = (c + 1) % view.columns();
      const int right = (c + view.columns() - 1) % view.columns();
      const double azimuth_gradient = (view.at(y, left) - view.at(y, right)) / (2.0 * column_rad);
      const double elevation_gradient =
          above == below ? 0.0
                         : (view.at(above, c) - view.at(below, c)) / ((below - above) * row_rad);
      // A step along theta shifts a point of the view by sin(azimuth - theta) / (range
      // cos(elevation)), and moves it up by cos(azimuth - theta) sin(elevation) / range.
      const double horizontal_change =
          azimuth_gradient / (range_m * std::max(std::cos(elevation), 1e-3));
      const double vertical_change = elevation_gradient * std::sin(elevation) / range_m;
      const double x = horizontal_change * std::sin(azimuth) + vertical_change * std::cos(azimuth);
      const double y_part =
          -horizontal_change * std::cos(azimuth) + vertical_change * std::sin(azimuth);
      for (std::size_t k = 0; k < count; ++k) {
        const Complex wave = std::polar(1.0, -static_cast<double>(k) * azimuth);
        along_x[k] += x * wave;
        along_y[k] += y_part * wave;
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      // Parallel to the component the change alters its magnitude, perpendicular its phase.
      const Complex unit =
          std::polar(1.0, -static_cast<double>(signature.phase_rad(y, static_cast<int>(k))));
      const double per_x = (along_x[k] * unit).real();
      const double per_y = (along_y[k] * unit).real();
      for (std::size_t i = 0; i < shape_directions; ++i) {
        const double theta = sector_rad * static_cast<double>(i) - pose.heading_rad;
        change[i] += std::abs(per_x * std::cos(theta) + per_y * std::sin(theta));
      }
    }
  }
  Directional extents{};
  for (std::size_t i = 0; i < shape_directions; ++i) {
    extents[i] = change[i] > 0.0 ? 1.0 / change[i] : 0.0;
  }
  return extents;
}

}  // namespace panonav::lab
