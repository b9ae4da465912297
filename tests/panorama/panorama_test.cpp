#include "panonav/panorama/panorama.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/panorama/picture.hpp"

namespace panonav {
namespace {

Panorama random_panorama(std::uint64_t seed, int rows, int columns) {
  Random random(seed);
  Panorama panorama(rows, columns, std::nullopt);
  for (float& value : panorama.values()) value = static_cast<float>(random.uniform());
  return panorama;
}

TEST(Panorama, KnowsTheAnglesOfItsRowsAndColumns) {
  const Panorama view(5, 8, ElevationBand{-0.4, 0.6});
  EXPECT_NEAR(view.elevation_rad(0), 0.5, 1e-12);
  EXPECT_NEAR(view.elevation_rad(4), -0.3, 1e-12);
  EXPECT_NEAR(view.azimuth_rad(0), 0.0, 1e-12);
  EXPECT_NEAR(view.azimuth_rad(2), std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(view.azimuth_rad(6), -std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(view.azimuth_rad(4), -std::numbers::pi, 1e-12);
}

TEST(Panorama, HorizonRowIsTheNearestToElevationZero) {
  for (const int rows : {1, 2, 7, 80}) {
    for (const ElevationBand band : {ElevationBand{-0.4, 0.6}, ElevationBand{-0.7, 0.1},
                                     ElevationBand{0.0, 0.5}, ElevationBand{-0.5, 0.0}}) {
      const Panorama view(rows, 8, band);
      int nearest = 0;
      for (int y = 1; y < rows; ++y) {
        if (std::abs(view.elevation_rad(y)) < std::abs(view.elevation_rad(nearest)) - 1e-12)
          nearest = y;
      }
      ASSERT_TRUE(view.horizon_row());
      EXPECT_NEAR(std::abs(view.elevation_rad(*view.horizon_row())),
                  std::abs(view.elevation_rad(nearest)), 1e-12);
    }
  }
  EXPECT_FALSE(Panorama(5, 8, std::nullopt).horizon_row());
  EXPECT_FALSE(Panorama(5, 8, ElevationBand{0.1, 0.5}).horizon_row());
  EXPECT_EQ(Panorama(5, 8, std::nullopt).elevation_rad(2), 0.0);
}

TEST(Panorama, RefusesBrokenInvariants) {
  EXPECT_THROW(Panorama(0, 8, std::nullopt), ContractError);
  EXPECT_THROW(Panorama(-1, 8, std::nullopt), ContractError);
  EXPECT_THROW(Panorama(1, 3, std::nullopt), ContractError);
  EXPECT_THROW(Panorama(1, 8, ElevationBand{0.5, 0.5}), ContractError);
  EXPECT_THROW(Panorama(1, 8, ElevationBand{-2.0, 0.5}), ContractError);
  EXPECT_THROW(Panorama(1, 8, ElevationBand{0.0, 1.6}), ContractError);
  EXPECT_THROW(Panorama(1, 8, ElevationBand{std::nan(""), 0.5}), ContractError);
  EXPECT_THROW(Panorama(1, 8, std::nullopt, std::vector<float>(7)), ContractError);
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    std::vector<float> values(16, 0.5F);
    values[15] = bad;
    EXPECT_THROW(Panorama(2, 8, std::nullopt, values), ContractError);
  }
  EXPECT_NO_THROW(Panorama(2, 8, std::nullopt, std::vector<float>(16, 3e38F)));
}

TEST(RotateColumns, FollowsTheConvention) {
  const Panorama view = random_panorama(1, 3, 12);
  const Panorama turned = rotate_columns(view, 5);
  for (int y = 0; y < 3; ++y) {
    for (int c = 0; c < 12; ++c) EXPECT_EQ(turned.at(y, c), view.at(y, (c + 5) % 12));
  }
  EXPECT_NE(turned, view);
  EXPECT_EQ(rotate_columns(turned, -5), view);
  EXPECT_EQ(rotate_columns(view, 12 * 7), view);
  EXPECT_EQ(rotate_columns(rotate_columns(view, 7), 9), rotate_columns(view, 4));
}

TEST(Mirror, TheLeftOfTheRobotBecomesItsRight) {
  const Panorama view = random_panorama(2, 3, 12);
  const Panorama image = mirror(view);
  for (int y = 0; y < 3; ++y) {
    for (int c = 0; c < 12; ++c) EXPECT_EQ(image.at(y, c), view.at(y, (12 - c) % 12));
  }
  EXPECT_NE(image, view);
  EXPECT_EQ(mirror(image), view);
  EXPECT_EQ(mirror(rotate_columns(view, 5)), rotate_columns(image, -5));
}

TEST(ToPicture, RunsClockwiseWithForwardInTheMiddle) {
  Panorama view(2, 8, std::nullopt);
  view.at(0, 0) = 1.0F;  // forward
  view.at(1, 2) = 0.5F;  // left
  view.at(1, 6) = 2.0F;  // right, too bright
  view.at(1, 7) = -1.0F;
  const Image picture = to_picture(view);
  EXPECT_EQ(picture.size(), (ImageSize{8, 2}));
  EXPECT_EQ(picture.at(4, 0), 255);
  EXPECT_EQ(picture.at(2, 1), 128);
  EXPECT_EQ(picture.at(6, 1), 255);
  int lit = 0;
  for (const std::uint8_t value : picture.pixels()) lit += value != 0;
  EXPECT_EQ(lit, 3);
}

TEST(ToPicture, IsReadBackExactly) {
  for (const int columns : {8, 90, 121, 512}) {
    Panorama view = random_panorama(2, 4, columns);
    for (float& value : view.values()) value = std::round(value * 255.0F) / 255.0F;
    const Image picture = to_picture(view);
    const Panorama back =
        panorama_from_picture(picture.view(), {.direction = ColumnDirection::clockwise,
                                               .forward_column = picture_forward_column(columns)});
    ASSERT_EQ(back.columns(), columns);
    for (std::size_t i = 0; i < view.values().size(); ++i) {
      EXPECT_NEAR(back.values()[i], view.values()[i], 1e-6);
    }
  }
}

}  // namespace
}  // namespace panonav
