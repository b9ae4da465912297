#include "panonav/panorama/sector_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::testing {
namespace {

constexpr ElevationBand sector_band{-0.5, 0.6};

/// Grey of a world at infinity, slow enough for any sampling.
double grey_at(const Direction3& direction) {
  return 0.5 + 0.2 * std::sin(3.0 * direction.azimuth_rad()) +
         0.2 * std::cos(4.0 * direction.elevation_rad() + direction.azimuth_rad());
}

/// Direction in the level frame of a direction that the tilted robot sees: rotated about x, then
/// about the level y axis.
Direction3 rotate_to_level(const Direction3& d, const Tilt& tilt) {
  const double y = std::cos(tilt.roll_rad) * d.y - std::sin(tilt.roll_rad) * d.z;
  const double z = std::sin(tilt.roll_rad) * d.y + std::cos(tilt.roll_rad) * d.z;
  return {std::cos(tilt.pitch_rad) * d.x + std::sin(tilt.pitch_rad) * z, y,
          -std::sin(tilt.pitch_rad) * d.x + std::cos(tilt.pitch_rad) * z};
}

Camera phone(double azimuth_rad) {
  Camera camera;
  camera.model = PinholeModel{.focal_length_px = 300.0, .azimuth_rad = azimuth_rad};
  camera.image_size = {420, 320};
  camera.centre = {210.0, 160.0};
  return camera;
}

Image take_picture(const Camera& camera, const Tilt& tilt) {
  Image image(camera.image_size.width, camera.image_size.height);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const auto seen = unproject(camera, {u + 0.5, v + 0.5});
      image.at(u, v) =
          static_cast<std::uint8_t>(std::lround(255.0 * grey_at(rotate_to_level(*seen, tilt))));
    }
  }
  return image;
}

TEST(SectorView, ShowsTheDirectionsOfTheCylinderAndMarksTheRest) {
  for (const Tilt& tilt : {Tilt{}, Tilt{0.08, -0.1}}) {
    const Camera camera = phone(2.9);
    const Image picture = take_picture(camera, tilt);
    const SectorView sector =
        unwarp_sector(picture.view(), camera, {60, 360}, sector_band, tilt).value();
    EXPECT_NEAR(shown_width(std::span(&sector, 1)), 2.0 * std::atan(210.0 / 300.0), radians(14.0));
    int visible = 0;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < sector.columns; ++x) {
        const auto at = static_cast<std::size_t>(y * sector.columns + x);
        const auto direction =
            Direction3::from_angles(sector.first_azimuth_rad + x * sector.column_rad(),
                                    sector_band.top_rad - (y + 0.5) * sector.row_rad());
        if (sector.visible[at] == 0) {
          EXPECT_EQ(sector.values[at], 0.0F);
          continue;
        }
        ++visible;
        ASSERT_NEAR(sector.values[at], grey_at(direction), 0.01);
      }
    }
    EXPECT_GT(visible, 60 * sector.columns / 2);
    EXPECT_LT(visible, 60 * sector.columns);  // its corners are not seen
  }
}

TEST(SectorView, RefusesOtherPictures) {
  const Camera camera = phone(0.0);
  const Image image = take_picture(camera, {});
  const Image small(10, 10);
  EXPECT_THROW((void)unwarp_sector(small.view(), camera, {60, 360}, sector_band), ContractError);
  EXPECT_FALSE(unwarp_sector(image.view(), camera, {60, 360}, {1.3, 1.5}).has_value());
  Camera sphere = camera;
  sphere.model = EquirectangularModel{};
  EXPECT_THROW((void)unwarp_sector(image.view(), sphere, {60, 360}, sector_band), ContractError);
}

}  // namespace
}  // namespace panonav::testing
