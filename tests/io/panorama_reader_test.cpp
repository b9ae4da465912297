#include "panonav/io/panorama_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

constexpr Tilt leaning{-0.07, 0.1};

double world(double x, double y, double z) {
  return 0.5 + 0.2 * std::sin(3.0 * x + 1.0) * std::cos(2.0 * y) +
         0.2 * std::sin(4.0 * z + 2.0 * y - x);
}

double seen_at(double elevation_rad, double azimuth_rad, const Tilt& tilt) {
  const double x = std::cos(elevation_rad) * std::cos(azimuth_rad);
  const double y = std::cos(elevation_rad) * std::sin(azimuth_rad);
  const double z = std::sin(elevation_rad);
  const double y1 = std::cos(tilt.roll_rad) * y - std::sin(tilt.roll_rad) * z;
  const double z1 = std::sin(tilt.roll_rad) * y + std::cos(tilt.roll_rad) * z;
  return world(std::cos(tilt.pitch_rad) * x + std::sin(tilt.pitch_rad) * z1, y1,
               -std::sin(tilt.pitch_rad) * x + std::cos(tilt.pitch_rad) * z1);
}

std::uint8_t grey(double value) {
  return static_cast<std::uint8_t>(std::lround(255.0 * value));
}

void expect_like(const Panorama& a, const Panorama& b, double tolerance) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.elevations(), b.elevations());
  double largest = 0.0;
  for (std::size_t i = 0; i < a.values().size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(a.values()[i] - b.values()[i])));
  EXPECT_LT(largest, tolerance);
}

// The kept band is level however the robot leans: what lies beside it in the picture is looked at.
TEST(PanoramaReader, LevelsTheBandOfASphere) {
  const auto make_image = [](const Tilt& tilt) {
    Image picture(512, 256, 1);
    for (int v = 0; v < 256; ++v) {
      for (int u = 0; u < 512; ++u) {
        const double elevation = std::numbers::pi * (0.5 - (v + 0.5) / 256.0);
        const double azimuth = 2.0 * std::numbers::pi * (0.5 - (u + 0.5) / 512.0);
        picture.at(u, v) = grey(seen_at(elevation, azimuth, tilt));
      }
    }
    return picture;
  };
  PictureSource source;
  source.kind = PictureKind::equirectangular;
  source.layout.elevations = ElevationBand{-std::numbers::pi / 2.0, std::numbers::pi / 2.0};
  for (const bool cut : {true, false}) {
    source.layout.kept_elevations =
        cut ? ElevationBand{radians(-30.0), radians(40.0)} : *source.layout.elevations;
    const PanoramaReader reader(source, {cut ? 60 : 0, 256});
    const Image level = make_image({});
    const Image tilted = make_image(leaning);
    const Panorama truth = reader.convert(level.view());
    expect_like(reader.convert(tilted.view(), leaning), truth, 0.01);
    EXPECT_EQ(reader.convert(level.view(), {}), truth);
  }
}

// The floor and the ceiling of a sphere are left out unless they are part of a stated band.
TEST(PanoramaReader, TheBandAroundTheHorizonIsTheDefaultOfASphere) {
  Image picture(360, 180, 1);
  for (int v = 0; v < 180; ++v) {
    for (int u = 0; u < 360; ++u) picture.at(u, v) = grey(v >= 50 && v < 120 ? u / 800.0 : 1.0);
  }
  PictureSource source{.kind = PictureKind::equirectangular};
  const PanoramaReader reader(source, {});
  const Panorama band = reader.convert(picture.view());
  EXPECT_EQ(band.elevations(), default_equirectangular_band);
  EXPECT_EQ(band.rows(), 70);
  EXPECT_LT(*std::ranges::max_element(band.values()), 0.6F);
  source.layout.elevations = ElevationBand{-std::numbers::pi / 2.0, std::numbers::pi / 2.0};
  source.layout.kept_elevations = default_equirectangular_band;
  EXPECT_EQ(reader.source(), source);
  EXPECT_EQ(PanoramaReader(source, {}).convert(picture.view()), band);
  source.layout.kept_elevations = source.layout.elevations;
  EXPECT_EQ(PanoramaReader(source, {}).convert(picture.view()).rows(), 180);
}

TEST(PanoramaReader, LevelsMirrorPicturesBeyondTheBandThatIsKept) {
  Camera camera;
  camera.model = EquiangularModel{radians(-60.0), radians(60.0)};
  camera.image_size = {480, 480};
  camera.centre = {240.0, 240.0};
  camera.inner_radius_px = 20.0;
  camera.rim_radius_px = 235.0;
  const auto make_image = [&](const Tilt& tilt) {
    Image picture(480, 480, 1);
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 480; ++u) {
        const auto direction = unproject(camera, {u + 0.5, v + 0.5});
        if (!direction) continue;
        picture.at(u, v) =
            grey(seen_at(std::atan2(direction->z, std::hypot(direction->x, direction->y)),
                         std::atan2(direction->y, direction->x), tilt));
      }
    }
    return picture;
  };
  PictureSource source;
  source.kind = PictureKind::mirror;
  source.camera = camera;
  source.layout.kept_elevations = ElevationBand{radians(-20.0), radians(30.0)};
  const PanoramaReader reader(source, {50, 256});
  const Image level = make_image({});
  const Image tilted = make_image(leaning);
  const Panorama truth = reader.convert(level.view());
  expect_like(reader.convert(tilted.view(), leaning), truth, 0.03);
  // Without the sensor it is another picture.
  const Panorama blind = reader.convert(tilted.view());
  EXPECT_GT(std::abs(static_cast<double>(blind.at(0, 0) - truth.at(0, 0))) +
                std::abs(static_cast<double>(blind.at(25, 40) - truth.at(25, 40))),
            0.03);
}

TEST(PanoramaReader, PanoramasOfUnknownElevationAreNotLevelled) {
  const PanoramaReader reader(PictureSource{}, {});
  const Image picture(64, 16, 1);
  EXPECT_NO_THROW((void)reader.convert(picture.view(), {0.0, radians(0.4)}));
  EXPECT_THROW((void)reader.convert(picture.view(), leaning), ContractError);
}

}  // namespace
}  // namespace panonav
