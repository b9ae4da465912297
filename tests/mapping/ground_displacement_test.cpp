#include "panonav/mapping/internal/ground_displacement.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/ground_lengths.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {
namespace {

constexpr int rows = 80;
constexpr int components = 20;
constexpr double height_m = 0.6;
constexpr double wall_m = 30.0;

/// An endless floor of smooth patches, with a round wall far away above the horizon.
class Plain {
 public:
  explicit Plain(std::uint64_t seed, double contrast = 0.1) : contrast_(contrast) {
    Random random(seed, 0);
    for (int i = 0; i < 24; ++i) {
      waves_.push_back({random.uniform(-1.2, 1.2), random.uniform(-1.2, 1.2),
                        random.uniform(0.0, 2.0 * std::numbers::pi)});
    }
  }

  [[nodiscard]] FourierSignature seen_from(const Pose2& pose) const {
    const ElevationBand band{.bottom_rad = radians(-40.0), .top_rad = radians(30.0)};
    Panorama view(rows, 256, band);
    for (int r = 0; r < rows; ++r) {
      const double elevation = band.top_rad - (band.top_rad - band.bottom_rad) * (r + 0.5) / rows;
      for (int c = 0; c < 256; ++c) {
        const double azimuth = 2.0 * std::numbers::pi * c / 256 + pose.heading_rad;
        view.at(r, c) = static_cast<float>(0.5 + value(pose, elevation, azimuth));
      }
    }
    return compute_signature(view, components);
  }

 private:
  struct Wave {
    double x, y, phase;
  };

  [[nodiscard]] double value(const Pose2& pose, double elevation, double azimuth) const {
    double away_m = wall_m;
    if (elevation < 0.0) away_m = std::min(wall_m, height_m / std::tan(-elevation));
    const double x_m = pose.x_m + away_m * std::cos(azimuth);
    const double y_m = pose.y_m + away_m * std::sin(azimuth);
    if (away_m >= wall_m) return 0.2 * std::sin(3.0 * std::atan2(y_m, x_m) + 5.0 * elevation);
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += std::sin(wave.x * x_m + wave.y * y_m + wave.phase);
    return contrast_ * sum / 3.0;
  }

  std::vector<Wave> waves_;
  double contrast_;
};

TEST(GroundDisplacement, LevelGroundTellsTheWayInCameraHeights) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Plain plain(seed);
    const Pose2 earlier{0.3, -0.4, 0.7};
    const HomingView before = homing_view(plain.seen_from(earlier));
    for (const double direction : {0.0, 1.2, -2.5}) {
      const Pose2 motion{0.12 * std::cos(direction), 0.12 * std::sin(direction), 0.2};
      const HomingView after = homing_view(plain.seen_from(earlier * motion));
      // The start is a quarter too short.
      const double start = 0.75 / height_m;
      const auto found = ground_displacement(
          before, after, {start * motion.x_m, start * motion.y_m, motion.heading_rad});
      ASSERT_TRUE(found.has_value());
      EXPECT_NEAR(found->x * height_m, motion.x_m, 0.006) << "seed " << seed;
      EXPECT_NEAR(found->y * height_m, motion.y_m, 0.006) << "seed " << seed;
      EXPECT_LT(found->deviation * height_m, 0.012);
    }
  }
}

TEST(GroundDisplacement, WhereTheRobotStandsStillIsNoWay) {
  const Plain plain(7);
  const HomingView view = homing_view(plain.seen_from({1.0, 2.0, 0.3}));
  const auto found = ground_displacement(view, view, {0.1, 0.05, 0.0});
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->x, 0.0, 1e-3);
  EXPECT_NEAR(found->y, 0.0, 1e-3);
}

TEST(GroundDisplacement, NoElevationsOrNoGroundNoAnswer) {
  Panorama unknown(rows, 128, std::nullopt);
  const HomingView without = homing_view(compute_signature(unknown, components));
  EXPECT_FALSE(ground_displacement(without, without, {}).has_value());
  Panorama sky(rows, 128, ElevationBand{.bottom_rad = radians(-12.0), .top_rad = radians(60.0)});
  const HomingView above = homing_view(compute_signature(sky, components));
  EXPECT_FALSE(ground_displacement(above, above, {}).has_value());
  // Ground without any pattern.
  Panorama plain(rows, 128, ElevationBand{.bottom_rad = radians(-40.0), .top_rad = radians(30.0)});
  const HomingView empty = homing_view(compute_signature(plain, components));
  EXPECT_FALSE(ground_displacement(empty, empty, {}).has_value());
  const HomingView fewer =
      homing_view(compute_signature(Panorama(40, 128, std::nullopt), components));
  EXPECT_THROW(static_cast<void>(ground_displacement(fewer, without, {})), ContractError);
}

TEST(GroundLengths, OdometryTellsMetresWhateverItsScale) {
  const Plain plain(11);
  for (const double scale_m : {1.5, 10.0}) {
    VisualOdometry odometry({.scale_m = scale_m, .camera_height_m = height_m});
    VisualOdometry without({.scale_m = scale_m});
    Pose2 pose{0.0, 0.0, 0.2};
    constexpr int steps = 25;
    for (int i = 0; i <= steps; ++i) {
      const OdometryView view(plain.seen_from(pose));
      odometry.add(view);
      without.add(view);
      pose = pose * Pose2{0.1, 0.0, 0.02};
    }
    const double path_m = std::hypot(odometry.pose().x_m, odometry.pose().y_m);
    const double guessed_m = std::hypot(without.pose().x_m, without.pose().y_m);
    EXPECT_NEAR(path_m, 0.1 * steps, 0.05 * steps * 0.1) << "scale " << scale_m;
    EXPECT_GT(std::abs(guessed_m - 0.1 * steps), 0.2 * steps * 0.1) << "guard: a guess is no metre";
  }
}

TEST(GroundLengths, RefusesAHeightThatIsNone) {
  EXPECT_THROW(GroundLengths(0.0), ContractError);
  EXPECT_THROW(GroundLengths(-1.0), ContractError);
}

}  // namespace
}  // namespace panonav
