#pragma once

#include <cmath>
#include <cstdint>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"
#include "support/random_views.hpp"

namespace panonav::testing {

inline constexpr ElevationBand patch_band{-0.5, 0.6};

/// A panorama of grey patches of 5 rows x 9 columns: many corners, each with surroundings of its
/// own.
inline Panorama make_patch_view(std::uint64_t seed, int rows = 80, int columns = 360) {
  Random random(seed);
  const Panorama small = random_panorama(random, (rows + 4) / 5, columns / 9);
  Panorama view(rows, columns, patch_band);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) view.at(y, x) = small.at(y / 5, x / 9);
  }
  return view;
}

/// Takes a picture of a pinhole camera in the middle of the panorama, turned by `azimuth_rad`;
/// black above and below its rows.
inline Image take_narrow_picture(const Panorama& view, double azimuth_rad, double field_of_view_rad,
                                 ImageSize size = {400, 300}) {
  Image image(size.width, size.height);
  const double focal_px = focal_length_from_field_of_view(size.width, field_of_view_rad);
  const PinholeModel lens{.focal_length_px = focal_px, .azimuth_rad = azimuth_rad};
  const auto& [bottom_rad, top_rad] = *view.elevations();
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const Direction3 seen =
          unproject(lens, u + 0.5 - 0.5 * size.width, 0.5 * size.height - v - 0.5);
      const double columns = seen.azimuth_rad() / (2.0 * std::numbers::pi) * view.columns();
      const int column =
          (static_cast<int>(std::lround(columns)) % view.columns() + view.columns()) %
          view.columns();
      const auto row = static_cast<int>(
          std::floor((top_rad - seen.elevation_rad()) / (top_rad - bottom_rad) * view.rows()));
      if (row < 0 || row >= view.rows()) continue;
      image.at(u, v) = static_cast<std::uint8_t>(std::lround(255.0F * view.at(row, column)));
    }
  }
  return image;
}

}  // namespace panonav::testing
