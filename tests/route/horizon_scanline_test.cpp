#include "panonav/route/horizon_scanline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

// Value: elevation in rows from the top plus a wave around.
Panorama wave(int rows, int columns, std::optional<ElevationBand> band) {
  Panorama panorama(rows, columns, band);
  for (int y = 0; y < rows; ++y) {
    for (int c = 0; c < columns; ++c) {
      panorama.at(y, c) =
          static_cast<float>(0.01 * y + 0.2 * std::sin(2.0 * std::numbers::pi * 3.0 * c / columns));
    }
  }
  return panorama;
}

TEST(HorizonScanline, IsTheRowOnTheHorizon) {
  // 21 rows of 1 degree; the middle of row 10 is the horizon.
  const auto panorama = wave(21, 360, ElevationBand{radians(-10.5), radians(10.5)});
  const auto line = horizon_scanline(panorama, {.columns = 360, .half_band_rad = 0.0});
  ASSERT_EQ(line.size(), 360U);
  for (int c = 0; c < 360; ++c) EXPECT_NEAR(line[c], panorama.at(10, c), 1e-6);
}

TEST(HorizonScanline, LiesBetweenRowsWhereTheHorizonDoes) {
  // Middles at -15, -5, 5 and 15 degrees.
  const auto panorama = wave(4, 64, ElevationBand{radians(-20.0), radians(20.0)});
  const auto line = horizon_scanline(panorama, {.columns = 64, .half_band_rad = 0.0});
  for (int c = 0; c < 64; ++c) {
    EXPECT_NEAR(line[c], 0.5F * (panorama.at(1, c) + panorama.at(2, c)), 1e-6);
  }
}

TEST(HorizonScanline, KeepsAzimuthsAtAnyNumberOfColumns) {
  for (const int columns : {90, 128, 360, 512, 720}) {
    for (const int samples : {90, 360, 1000}) {
      const auto panorama = wave(3, columns, std::nullopt);
      const auto line = horizon_scanline(panorama, {.columns = samples});
      ASSERT_EQ(line.size(), static_cast<std::size_t>(samples));
      for (int c = 0; c < samples; ++c) {
        EXPECT_NEAR(line[c], 0.01 + 0.2 * std::sin(2.0 * std::numbers::pi * 3.0 * c / samples),
                    0.012);
      }
    }
  }
}

TEST(HorizonScanline, RefusesAViewWithoutAHorizon) {
  EXPECT_THROW((void)horizon_scanline(wave(4, 64, ElevationBand{0.2, 0.5})), ContractError);
  EXPECT_THROW((void)horizon_scanline(wave(4, 64, std::nullopt), {.columns = 3}), OptionError);
}

}  // namespace
}  // namespace panonav
