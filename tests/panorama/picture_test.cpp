#include "panonav/panorama/picture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

/// A smooth world, seen at (azimuth, elevation).
double world(double azimuth, double elevation) {
  return 0.5 + 0.2 * std::cos(azimuth) + 0.1 * std::sin(3.0 * azimuth + 0.4) +
         0.15 * std::sin(2.0 * elevation);
}

/// A picture of it. Column and row centres at (i + 0.5) / size.
Image picture_of_world(int width, int height, ColumnDirection direction, double forward,
                       ElevationBand band) {
  Image picture(width, height);
  const double sign = direction == ColumnDirection::clockwise ? -1.0 : 1.0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double azimuth = sign * ((u + 0.5) / width - forward) * 2.0 * std::numbers::pi;
      const double elevation = band.top_rad - (v + 0.5) / height * (band.top_rad - band.bottom_rad);
      picture.at(u, v) = static_cast<std::uint8_t>(std::lround(255.0 * world(azimuth, elevation)));
    }
  }
  return picture;
}

TEST(PanoramaFromPicture, PutsEveryDirectionWhereItBelongs) {
  const ElevationBand full{-std::numbers::pi / 2, std::numbers::pi / 2};
  const ElevationBand kept{-0.5, 0.7};
  int checked = 0;
  for (const auto direction : {ColumnDirection::clockwise, ColumnDirection::counter_clockwise}) {
    for (const double forward : {0.0, 0.25, 0.5, 0.77, 1.0}) {
      for (const PanoramaShape shape : {PanoramaShape{20, 64}, PanoramaShape{0, 0},
                                        PanoramaShape{40, 512}, PanoramaShape{7, 90}}) {
        const Image picture = picture_of_world(256, 128, direction, forward, full);
        const Panorama view =
            panorama_from_picture(picture.view(), {direction, forward, full, kept}, shape);
        EXPECT_EQ(view.columns(), shape.columns == 0 ? 256 : shape.columns);
        EXPECT_EQ(view.rows(), shape.rows == 0 ? 49 : shape.rows);  // 128 * 1.2 / pi = 48.9
        EXPECT_EQ(view.elevations(), kept);
        double worst = 0.0;
        for (int y = 0; y < view.rows(); ++y) {
          for (int c = 0; c < view.columns(); ++c) {
            worst = std::max(
                worst, std::abs(view.at(y, c) - world(view.azimuth_rad(c), view.elevation_rad(y))));
            ++checked;
          }
        }
        // Half a grey level of the picture, and what a coarse row takes from its surroundings.
        EXPECT_LT(worst, shape.rows == 7 ? 0.02 : 0.004);
      }
    }
  }
  EXPECT_GT(checked, 100000);
}

TEST(PanoramaFromPicture, CopiesWhereColumnsFallOnColumns) {
  Random random(1);
  Image picture(12, 3);
  for (auto& value : picture.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  // Forward is the middle of column 4.
  const Panorama view = panorama_from_picture(
      picture.view(), {.direction = ColumnDirection::clockwise, .forward_column = 4.5 / 12});
  for (int y = 0; y < 3; ++y) {
    for (int c = 0; c < 12; ++c) {
      EXPECT_NEAR(view.at(y, c) * 255.0F, picture.at((4 - c + 12) % 12, y), 1e-4);
    }
  }
  EXPECT_FALSE(view.elevations());
}

TEST(PanoramaFromPicture, DoesNotAlias) {
  // Stripes finer than the columns wanted must become grey, not slow waves.
  Image picture(1024, 64);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 1024; ++u) picture.at(u, v) = ((u / 2 + v / 2) % 2) != 0 ? 255 : 0;
  }
  const Panorama view =
      panorama_from_picture(picture.view(), {.forward_column = 0.3}, {.rows = 10, .columns = 60});
  for (const float value : view.values()) EXPECT_NEAR(value, 0.5F, 0.02F);
}

TEST(PanoramaFromPicture, KeepsAConstantAndTheRange) {
  const Image grey(100, 10, 1, std::vector<std::uint8_t>(1000, 255));
  for (const PanoramaShape shape : {PanoramaShape{3, 33}, PanoramaShape{20, 301}}) {
    const Panorama view = panorama_from_picture(grey.view(), {}, shape);
    for (const float value : view.values()) {
      EXPECT_NEAR(value, 1.0F, 1e-5F);
      EXPECT_LE(value, 1.0F);
    }
  }
}

TEST(PanoramaFromPicture, TakesColourAsGrey) {
  Random random(2);
  Image colour(16, 4, 3);
  for (auto& value : colour.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  const Image grey = to_grey(colour.view());
  EXPECT_EQ(panorama_from_picture(colour.view(), {}), panorama_from_picture(grey.view(), {}));
  Image sphere(64, 32, 3);
  for (auto& value : sphere.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  const Image grey_sphere = to_grey(sphere.view());
  const ElevationBand full{-std::numbers::pi / 2, std::numbers::pi / 2};
  for (const ElevationBand kept : {full, ElevationBand{-0.5, 0.7}, ElevationBand{0.8, full.top_rad},
                                   ElevationBand{full.bottom_rad, -1.2}}) {
    const PictureLayout layout{.elevations = full, .kept_elevations = kept};
    for (const PanoramaShape shape : {PanoramaShape{}, PanoramaShape{5, 20}}) {
      EXPECT_EQ(panorama_from_picture(sphere.view(), layout, shape),
                panorama_from_picture(grey_sphere.view(), layout, shape));
    }
  }
}

TEST(PanoramaFromPicture, RefusesBadLayouts) {
  const Image picture(16, 4);
  const auto read = [&](const PictureLayout& layout, PanoramaShape shape = {}) {
    static_cast<void>(panorama_from_picture(picture.view(), layout, shape));
  };
  EXPECT_NO_THROW(read({}));
  EXPECT_THROW(read({.forward_column = -0.1}), ContractError);
  EXPECT_THROW(read({.forward_column = 1.1}), ContractError);
  EXPECT_THROW(read({.forward_column = std::nan("")}), ContractError);
  EXPECT_THROW(read({.elevations = ElevationBand{0.2, 0.1}}), ContractError);
  EXPECT_THROW(read({.elevations = ElevationBand{-2.0, 0.1}}), ContractError);
  EXPECT_THROW(read({.kept_elevations = ElevationBand{-0.2, 0.1}}), ContractError);
  EXPECT_THROW(
      read({.elevations = ElevationBand{-0.1, 0.1}, .kept_elevations = ElevationBand{-0.2, 0.1}}),
      ContractError);
  EXPECT_THROW(read({}, {.rows = -1}), ContractError);
  EXPECT_THROW(read({}, {.columns = 3}), ContractError);
  const Image narrow(3, 3);
  EXPECT_THROW(static_cast<void>(panorama_from_picture(narrow.view(), {})), ContractError);
}

}  // namespace
}  // namespace panonav
