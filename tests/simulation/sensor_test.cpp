#include "panonav_simulation/sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav_simulation/mirror.hpp"
#include "support/scene_views.hpp"

namespace panonav::simulation {
namespace {

Panorama even_view(int rows, int columns, float value) {
  return {rows, columns, ElevationBand{-0.5, 0.5},
          std::vector<float>(static_cast<std::size_t>(rows) * columns, value)};
}

SensorOptions noiseless() {
  return {.read_noise = 0.0, .full_well = 1e12, .eight_bit = false};
}

TEST(Sensor, NoiseIsReadNoiseAndShotNoise) {
  SensorOptions options{.read_noise = 0.01, .full_well = 2000.0, .eight_bit = false};
  for (const float light : {0.2F, 0.5F, 0.7F}) {
    for (const double gain : {1.0, 1.2}) {
      options.gain = gain;
      const testing::Moments seen =
          testing::moments_of(apply_sensor(even_view(100, 400, light), options, 5));
      const double expected = gain * std::sqrt(1e-4 + light / 2000.0);
      EXPECT_NEAR(seen.mean, gain * light, 5.0 * expected / 200.0);
      // The deviation of 40000 values is known to 0.35 %.
      EXPECT_NEAR(seen.deviation, expected, 0.02 * expected);
    }
  }
}

TEST(Sensor, NoNoiseAndNoRoundingChangesNothing) {
  Panorama view(3, 8, std::nullopt);
  for (int c = 0; c < 8; ++c) view.at(1, c) = 0.1F * static_cast<float>(c);
  const Panorama seen = apply_sensor(view, noiseless(), 1);
  for (std::size_t i = 0; i < view.values().size(); ++i) {
    EXPECT_NEAR(seen.values()[i], view.values()[i], 1e-5);
  }
}

TEST(Sensor, ExposureScalesLightAndFullPixelsClip) {
  SensorOptions options = noiseless();
  options.exposure = 3.0;
  EXPECT_NEAR(apply_sensor(even_view(1, 4, 0.2F), options, 1).at(0, 0), 0.6, 1e-4);
  EXPECT_NEAR(apply_sensor(even_view(1, 4, 0.5F), options, 1).at(0, 0), 1.0, 1e-4);
}

TEST(Sensor, SameSeedSameBitsOtherSeedOthers) {
  SensorOptions options;
  options.occluded_fraction = 0.2;
  const Panorama view = even_view(10, 64, 0.5F);
  EXPECT_EQ(apply_sensor(view, options, 9), apply_sensor(view, options, 9));
  EXPECT_NE(apply_sensor(view, options, 9), apply_sensor(view, options, 10));
}

TEST(Sensor, EightBitValuesAreMultiplesOf255th) {
  const Panorama seen = apply_sensor(even_view(4, 64, 0.3F), {}, 2);
  for (const float value : seen.values()) {
    EXPECT_NEAR(255.0F * value, std::round(255.0F * value), 1e-4);
  }
}

TEST(Sensor, OccludersHideTheirShareFromTopToBottom) {
  SensorOptions options = noiseless();
  options.occluded_fraction = 0.1;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Panorama seen = apply_sensor(even_view(6, 3600, 0.9F), options, seed);
    int hidden = 0;
    for (int c = 0; c < seen.columns(); ++c) {
      const bool is_hidden = std::abs(seen.at(0, c) - 0.9F) > 1e-3F;
      if (is_hidden) ++hidden;
      for (int y = 1; y < seen.rows(); ++y) {
        EXPECT_EQ(std::abs(seen.at(y, c) - 0.9F) > 1e-3F, is_hidden);
      }
    }
    EXPECT_NEAR(hidden, 360, 3) << "seed " << seed;
  }
}

TEST(Sensor, DirectionalLightIsBrighterOnItsSide) {
  SensorOptions options = noiseless();
  options.directional_light = 0.3;
  options.light_azimuth_rad = 0.5 * std::numbers::pi;
  const Panorama seen = apply_sensor(even_view(1, 8, 0.5F), options, 1);
  EXPECT_NEAR(seen.at(0, 2), 0.65, 1e-4);
  EXPECT_NEAR(seen.at(0, 6), 0.35, 1e-4);
  EXPECT_NEAR(seen.at(0, 0), 0.5, 1e-4);
}

TEST(Sensor, ImageAndPanoramaAgreeOnWhereTheOccludersStand) {
  const Camera camera = make_simulated_mirror_camera();
  SensorOptions options = noiseless();
  options.occluded_fraction = 0.25;
  const Radiance white{640, 480, 1, std::vector<float>(640U * 480U, 0.9F)};
  const Image image = apply_sensor(white, camera, options, 4);
  const Panorama panorama = apply_sensor(even_view(20, 720, 0.9F), options, 4);
  int compared = 0;
  int differing = 0;
  int hidden_columns = 0;
  for (int c = 0; c < panorama.columns(); ++c) {
    const auto at = project(camera, Direction3::from_angles(panorama.azimuth_rad(c), -0.1));
    ASSERT_TRUE(at.has_value());
    const bool hidden_in_image =
        std::abs(image.at(static_cast<int>(at->u_px), static_cast<int>(at->v_px)) - 230) > 1;
    const bool hidden = std::abs(panorama.at(10, c) - 0.9F) > 2e-3F;
    hidden_columns += hidden ? 1 : 0;
    ++compared;
    differing += hidden == hidden_in_image ? 0 : 1;
  }
  EXPECT_EQ(compared, 720);
  EXPECT_NEAR(hidden_columns, 180, 4);
  EXPECT_LE(differing, 12);  // pixels on the six borders may fall to either side
}

TEST(Sensor, VignettingDarkensTowardsTheRim) {
  const Camera camera = make_simulated_mirror_camera();
  SensorOptions options = noiseless();
  options.vignetting = 0.4;
  const Radiance white{640, 480, 1, std::vector<float>(640U * 480U, 0.5F)};
  const Image image = apply_sensor(white, camera, options, 1);
  EXPECT_NEAR(image.at(320, 240), 127.5, 1.0);
  EXPECT_NEAR(image.at(320 + 228, 240), 0.6 * 127.5, 1.5);
}

TEST(Sensor, RefusesBadOptionsAndSizes) {
  EXPECT_THROW((void)apply_sensor(even_view(1, 4, 0.5F), {.exposure = 0.0}, 1), OptionError);
  EXPECT_THROW((void)apply_sensor(even_view(1, 4, 0.5F), {.occluded_fraction = 1.5}, 1),
               OptionError);
  EXPECT_THROW((void)apply_sensor(even_view(1, 4, 0.5F), {.read_noise = std::nan("")}, 1),
               OptionError);
  const Radiance small{64, 48, 1, std::vector<float>(64U * 48U)};
  EXPECT_THROW((void)apply_sensor(small, make_simulated_mirror_camera(), {}, 1), ContractError);
}

}  // namespace
}  // namespace panonav::simulation
