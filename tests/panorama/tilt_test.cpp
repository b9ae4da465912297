#include "panonav/panorama/tilt.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

// Brightness of a direction of the world: smooth, without symmetry.
double world(const std::array<double, 3>& d) {
  return 0.5 + 0.2 * std::sin(3.0 * d[0] + 1.0) * std::cos(2.0 * d[1]) +
         0.2 * std::sin(4.0 * d[2] + 2.0 * d[1] - d[0]);
}

// Rolled about x, then pitched about y: matrices as they stand in textbooks.
std::array<double, 3> world_from_robot(const std::array<double, 3>& d, const Tilt& tilt) {
  const double r = tilt.roll_rad;
  const double p = tilt.pitch_rad;
  const std::array<double, 3> rolled{d[0], std::cos(r) * d[1] - std::sin(r) * d[2],
                                     std::sin(r) * d[1] + std::cos(r) * d[2]};
  return {std::cos(p) * rolled[0] + std::sin(p) * rolled[2], rolled[1],
          -std::sin(p) * rolled[0] + std::cos(p) * rolled[2]};
}

Panorama seen_by(const Tilt& tilt, int rows, int columns, const ElevationBand& band) {
  Panorama panorama(rows, columns, band);
  for (int y = 0; y < rows; ++y) {
    const double e = panorama.elevation_rad(y);
    for (int c = 0; c < columns; ++c) {
      const double a = panorama.azimuth_rad(c);
      panorama.at(y, c) = static_cast<float>(world(world_from_robot(
          {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)}, tilt)));
    }
  }
  return panorama;
}

double largest_error(const Panorama& a, const Panorama& b, int first_row, int last_row) {
  double largest = 0.0;
  for (int y = first_row; y <= last_row; ++y) {
    for (int c = 0; c < a.columns(); ++c)
      largest = std::max(largest, std::abs(static_cast<double>(a.at(y, c) - b.at(y, c))));
  }
  return largest;
}

constexpr ElevationBand sphere{-std::numbers::pi / 2.0, std::numbers::pi / 2.0};

TEST(Tilt, LevelledIsWhatALevelRobotSees) {
  Random random(3);
  for (int i = 0; i < 10; ++i) {
    const double largest = i < 5 ? radians(6.0) : max_tilt_rad;
    const Tilt tilt{random.uniform(-largest, largest), random.uniform(-largest, largest)};
    SCOPED_TRACE(i);
    // The whole sphere, poles included: nothing is missing.
    const Panorama seen = seen_by(tilt, 90, 256, sphere);
    const Panorama truth = seen_by({}, 90, 256, sphere);
    EXPECT_LT(largest_error(level_panorama(seen, tilt), truth, 0, 89), 0.015);
    EXPECT_GT(largest_error(seen, truth, 0, 89), 0.02);
    // A band of it, of other rows, where the picture shows more.
    const ElevationBand band{radians(-20.0), radians(40.0)};
    EXPECT_LT(
        largest_error(level_panorama(seen, tilt, 40, band), seen_by({}, 40, 256, band), 0, 39),
        0.004);
  }
}

TEST(Tilt, RowsBeyondTheBandRepeatTheNearestOne) {
  const ElevationBand band{radians(-30.0), radians(30.0)};
  const Tilt tilt{radians(4.0), radians(-5.0)};
  const Panorama level = level_panorama(seen_by(tilt, 60, 256, band), tilt);
  const Panorama truth = seen_by({}, 60, 256, band);
  EXPECT_LT(largest_error(level, truth, 7, 52), 0.002);
  EXPECT_LT(largest_error(level, truth, 0, 59), 0.15);  // not an edge of the height of the picture
  Panorama grey(60, 256, band);
  for (float& value : grey.values()) value = 0.75F;
  EXPECT_EQ(level_panorama(grey, tilt), grey);
}

TEST(Tilt, PositivePitchLowersTheFrontAndPositiveRollTheRightSide) {
  // The horizon as a bright row: ahead of a robot that looks down it stands higher in the picture.
  const ElevationBand band{radians(-30.0), radians(30.0)};
  Panorama seen(60, 256, band);
  for (int c = 0; c < 256; ++c) {
    const double a = seen.azimuth_rad(c);
    for (int y = 0; y < 60; ++y) {
      const double horizon = radians(6.0) * std::cos(a) - radians(3.0) * std::sin(a);
      const double off = (seen.elevation_rad(y) - horizon) / radians(2.0);
      seen.at(y, c) = static_cast<float>(std::exp(-off * off));
    }
  }
  const Panorama level = level_panorama(seen, {radians(3.0), radians(6.0)});
  for (int c = 0; c < 256; ++c) {
    EXPECT_GT(level.at(29, c) + level.at(30, c), 1.7F) << c;
    EXPECT_LT(level.at(25, c) + level.at(34, c), 0.1F) << c;
  }
}

TEST(Tilt, NoTiltChangesNoBit) {
  const Panorama seen = seen_by({0.1, 0.2}, 20, 64, {radians(-20.0), radians(30.0)});
  EXPECT_EQ(level_panorama(seen, {}), seen);
}

TEST(Tilt, NeedsElevationsAndARobotThatStands) {
  const Panorama flat(10, 32, {});
  EXPECT_EQ(level_panorama(flat, {radians(0.5), radians(-0.5)}), flat);
  EXPECT_THROW((void)level_panorama(flat, {0.0, radians(0.6)}), ContractError);
  const Panorama banded(10, 32, ElevationBand{-0.3, 0.3});
  EXPECT_THROW((void)level_panorama(banded, {radians(31.0), 0.0}), ContractError);
  EXPECT_THROW((void)level_panorama(banded, {std::nan(""), 0.0}), ContractError);
}

}  // namespace
}  // namespace panonav
