#include "panonav/panorama/sector_view.hpp"

#include <algorithm>
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

/// Directions of points within the solid angle of each value of a sector, in the frame of a lens.
class LevelGrid {
 public:
  /// Number of points along each side of a value.
  static constexpr int taps = 2;

  LevelGrid(const SectorView& sector, const PinholeModel& lens, const Tilt& tilt) {
    const FisheyeLens::Rotation rotation = find_rotation(lens);
    const auto rotate = [&](const Direction3& level) {
      return rotation.lens_from_robot(tilt_direction(level, tilt));
    };
    up_ = rotate({0.0, 0.0, 1.0});
    const auto offset = [](int tap) { return (tap + 0.5) / taps - 0.5; };
    for (int i = 0; i < taps * sector.columns; ++i) {
      const double azimuth_rad =
          sector.first_azimuth_rad + (i / taps + offset(i % taps)) * sector.column_rad();
      across_.push_back(rotate(Direction3::from_angles(azimuth_rad, 0.0)));
    }
    for (int i = 0; i < taps * sector.panorama.rows; ++i) {
      const double elevation_rad =
          sector.elevations.top_rad - (i / taps + 0.5 + offset(i % taps)) * sector.row_rad();
      cosines_.push_back(std::cos(elevation_rad));
      sines_.push_back(std::sin(elevation_rad));
    }
  }
  /// Returns the direction of tap `left` of column `x` and tap `down` of row `y`.
  [[nodiscard]] Direction3 in_lens(int x, int left, int y, int down) const {
    const Direction3& d = across_[static_cast<std::size_t>(taps * x + left)];
    const auto row = static_cast<std::size_t>(taps * y + down);
    const double c = cosines_[row];
    const double s = sines_[row];
    return {c * d.x + s * up_.x, c * d.y + s * up_.y, c * d.z + s * up_.z};
  }

 private:
  Direction3 up_;                        // up direction of the level frame, in that of the lens
  std::vector<Direction3> across_;       // horizontal directions of each tap of the columns
  std::vector<double> cosines_, sines_;  // elevations of each tap of the rows
};

}  // namespace

double SectorView::column_rad() const noexcept {
  return 2.0 * std::numbers::pi / panorama.columns;
}
double SectorView::row_rad() const noexcept {
  return (elevations.top_rad - elevations.bottom_rad) / panorama.rows;
}
double shown_width(std::span<const SectorView> sectors) {
  if (sectors.empty()) return 0.0;
  const int columns = sectors.front().panorama.columns;
  std::vector<std::uint8_t> shown(static_cast<std::size_t>(columns));
  for (const SectorView& sector : sectors) {
    const auto first =
        static_cast<int>(std::lround(sector.first_azimuth_rad / sector.column_rad()));
    for (std::size_t i = 0; i < sector.visible.size(); ++i) {
      if (sector.visible[i] == 0) continue;
      const int column = first + static_cast<int>(i % static_cast<std::size_t>(sector.columns));
      shown[static_cast<std::size_t>((column % columns + columns) % columns)] = 1;
    }
  }
  return static_cast<double>(std::ranges::count(shown, 1)) * sectors.front().column_rad();
}

std::optional<SectorView> unwarp_sector(ImageView picture, const Camera& camera,
                                        PanoramaShape shape, const ElevationBand& elevations,
                                        const Tilt& tilt) {
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
  const LevelGrid grid(sector, *lens, tilt);
  bool shows_any = false;
  std::size_t at = 0;
  for (int y = 0; y < shape.rows; ++y) {
    for (int x = 0; x < sector.columns; ++x, ++at) {
      double sum = 0.0;
      int seen = 0;
      for (int down = 0; down < LevelGrid::taps; ++down) {
        for (int left = 0; left < LevelGrid::taps; ++left) {
          const auto pixel = project_from_lens(camera, *lens, grid.in_lens(x, left, y, down));
          if (!pixel) continue;
          sum += sample_bilinearly(image, scale * pixel->u_px, scale * pixel->v_px);
          ++seen;
        }
      }
      if (seen < LevelGrid::taps * LevelGrid::taps) continue;
      sector.values[at] = static_cast<float>(sum / (seen * 255.0));
      sector.visible[at] = 1;
      shows_any = true;
    }
  }
  if (!shows_any) return std::nullopt;
  return sector;
}

}  // namespace panonav
