#include "panonav/panorama/sector_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/remap.hpp"

namespace panonav {

namespace {

double sample_bilinearly(const Image& image, double u_px, double v_px) {
  const double u = std::clamp(u_px - 0.5, 0.0, image.width() - 1.0);
  const double v = std::clamp(v_px - 0.5, 0.0, image.height() - 1.0);
  const int x = std::min(static_cast<int>(u), std::max(0, image.width() - 2));
  const int y = std::min(static_cast<int>(v), std::max(0, image.height() - 2));
  const int right = std::min(x + 1, image.width() - 1);
  const int below = std::min(y + 1, image.height() - 1);
  const double a = u - x;
  const double b = v - y;
  return (1.0 - b) * ((1.0 - a) * image.at(x, y) + a * image.at(right, y)) +
         b * ((1.0 - a) * image.at(x, below) + a * image.at(right, below));
}

/// Returns the azimuth by which the picture may reach from the middle column: the largest of its
/// border and corners, or all around if it shows a pole.
double find_half_width(const Camera& camera, double middle_rad, const Tilt& tilt) {
  const auto [width, height] = camera.image_size;
  double half_rad = 0.0;
  constexpr int steps = 16;
  const auto visit = [&](double u_px, double v_px) {
    const auto seen = unproject(camera, {u_px, v_px});
    if (!seen) return;
    half_rad = std::max(half_rad, std::abs(angle_difference(
                                      level_direction(*seen, tilt).azimuth_rad(), middle_rad)));
  };
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    visit(share * width, 0.0);
    visit(share * width, height);
    visit(0.0, share * height);
    visit(width, share * height);
  }
  return half_rad;
}

}  // namespace

double SectorView::column_rad() const noexcept {
  return 2.0 * std::numbers::pi / panorama.columns;
}
double SectorView::row_rad() const noexcept {
  return (elevations.top_rad - elevations.bottom_rad) / panorama.rows;
}
double SectorView::width_rad() const noexcept {
  int count = 0;
  for (int x = 0; x < columns; ++x) {
    for (int y = 0; y < panorama.rows; ++y) {
      if (visible[static_cast<std::size_t>(y) * columns + x] == 0) continue;
      ++count;
      break;
    }
  }
  return count * column_rad();
}

SectorView unwarp_sector(ImageView picture, const Camera& camera, PanoramaShape shape,
                         const ElevationBand& elevations, const Tilt& tilt) {
  validate(camera);
  validate(tilt);
  const auto* const lens = std::get_if<PinholeModel>(&camera.model);
  if (lens == nullptr) throw ContractError("model", "another", "pinhole");
  if (picture.size() != camera.image_size) {
    throw ContractError("image size",
                        std::to_string(picture.width) + " x " + std::to_string(picture.height),
                        std::to_string(camera.image_size.width) + " x " +
                            std::to_string(camera.image_size.height) + ", as the camera's images");
  }
  SectorView sector;
  sector.panorama = shape;
  sector.elevations = elevations;
  const double step_rad = sector.column_rad();
  Image image = to_grey(picture);
  double scale = 1.0;  // of pixel coordinates in `image`
  while (image.width() >= 4 && image.height() >= 4 &&
         lens->focal_length_px * scale * std::min(step_rad, sector.row_rad()) >= 2.0) {
    Image half(image.width() / 2, image.height() / 2);
    kernels::halve(image.view(), half.pixels().data(), kernels::chosen_instructions());
    image = std::move(half);
    scale *= 0.5;
  }
  const double half_rad = find_half_width(camera, lens->azimuth_rad, tilt);
  const int half =
      std::min(static_cast<int>(std::ceil(half_rad / step_rad)), (shape.columns - 1) / 2);
  sector.columns = 2 * half + 1;
  sector.first_azimuth_rad = lens->azimuth_rad - half * step_rad;
  const auto size = static_cast<std::size_t>(shape.rows) * static_cast<std::size_t>(sector.columns);
  sector.values.resize(size);
  sector.visible.resize(size);
  constexpr std::array<double, 2> taps{-0.25, 0.25};
  bool shows_any = false;
  std::size_t at = 0;
  for (int y = 0; y < shape.rows; ++y) {
    for (int x = 0; x < sector.columns; ++x, ++at) {
      double sum = 0.0;
      int seen = 0;
      for (const double down : taps) {
        for (const double left : taps) {
          const auto level =
              Direction3::from_angles(sector.first_azimuth_rad + (x + left) * step_rad,
                                      elevations.top_rad - (y + 0.5 + down) * sector.row_rad());
          const auto pixel = project(camera, tilt_direction(level, tilt));
          if (!pixel) continue;
          sum += sample_bilinearly(image, scale * pixel->u_px, scale * pixel->v_px);
          ++seen;
        }
      }
      if (seen < 4) continue;
      sector.values[at] = static_cast<float>(sum / (4.0 * 255.0));
      sector.visible[at] = 1;
      shows_any = true;
    }
  }
  require(shows_any, "elevations of the picture", 0.0, "some of those of the memory");
  return sector;
}

}  // namespace panonav
