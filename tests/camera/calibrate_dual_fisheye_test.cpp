#include "panonav/camera/calibrate_dual_fisheye.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/skips.hpp"
#include "support/test_cameras.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

/// Waves of 6 to 60 degrees in all directions, in the order of the seed.
std::function<double(double, double)> wavy_world(std::uint64_t seed) {
  struct Wave {
    double x, y, z, phase;
  };
  Random random(seed);
  std::vector<Wave> waves;
  for (int i = 0; i < 30; ++i) {
    const auto d =
        Direction3::from_angles(random.uniform(-3.14, 3.14), std::asin(random.uniform(-1.0, 1.0)));
    const double k = 6 * std::pow(10.0, random.uniform());
    waves.push_back({k * d.x, k * d.y, k * d.z, random.uniform(0.0, 6.28)});
  }
  return [waves](double azimuth, double elevation) {
    const auto d = Direction3::from_angles(azimuth, elevation);
    double sum = 0.5;
    for (const Wave& w : waves) sum += 0.05 * std::cos(w.x * d.x + w.y * d.y + w.z * d.z + w.phase);
    return std::clamp(sum, 0.0, 1.0);
  };
}

std::vector<Image> turned_pictures(const Camera& camera, std::uint64_t seed,
                                   const std::vector<double>& turns_deg, double noise = 2.0) {
  const auto world = wavy_world(seed);
  Random random(seed + 100);
  std::vector<Image> pictures;
  for (const double turn : turns_deg) {
    pictures.push_back(render(
        camera,
        [&](double azimuth, double elevation) { return world(azimuth + radians(turn), elevation); },
        1));
    for (auto& pixel : pictures.back().pixels()) {
      pixel = static_cast<std::uint8_t>(std::clamp(pixel + random.normal(0, noise), 0.0, 255.0));
    }
  }
  return pictures;
}

auto calibrate(const std::vector<Image>& pictures, const DualFisheyeCalibration::Knowledge& known,
               int threads = 2) {
  std::vector<ImageView> views;
  for (const Image& picture : pictures) views.push_back(picture.view());
  Executor executor(threads);
  return calibrate_dual_fisheye(views, known, executor);
}

/// Largest azimuth error within 30 degrees of the horizon, less its mean.
double azimuth_error(const Camera& truth, const Camera& found) {
  std::vector<double> errors;
  double mean = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto d = Direction3::from_angles(0.37 * i, radians(30) * std::sin(i));
    const auto again = unproject(found, project(truth, d).value());
    if (!again) return 10;
    errors.push_back(angle_difference(again->azimuth_rad(), d.azimuth_rad()));
    mean += errors.back() / 1000;
  }
  double worst = 0;
  for (const double error : errors) worst = std::max(worst, std::abs(error - mean));
  return worst;
}

std::string reason(const std::variant<DualFisheyeCalibration, std::string>& answer) {
  const auto* refusal = std::get_if<std::string>(&answer);
  return refusal == nullptr ? "calibrated" : *refusal;
}

TEST(CalibrateDualFisheye, RecoversTheLensesFromTurnedPictures) {
  Camera camera = dual_fisheye_camera();
  for (const auto direction : {ColumnDirection::clockwise, ColumnDirection::counter_clockwise}) {
    if (sanitized && direction == ColumnDirection::counter_clockwise) continue;  // takes minutes
    camera.direction = direction;
    const auto pictures = turned_pictures(camera, 5, {0, 80, 170});
    DualFisheyeCalibration::Knowledge known;
    known.left_roll_rad = radians(90);
    known.right_roll_rad = radians(-90);
    known.direction = direction;
    // Roughly known turns are as good as none.
    if (direction == ColumnDirection::counter_clockwise) known.turn_rad = radians(83);
    const auto answer = calibrate(pictures, known);
    ASSERT_EQ(reason(answer), "calibrated");
    const auto& found = std::get<DualFisheyeCalibration>(answer);
    EXPECT_LT(degrees(azimuth_error(camera, found.camera)), 0.1);
    EXPECT_LT(degrees(found.azimuth_deviation_rad), 0.2);
    EXPECT_GT(found.inlier_share, 0.7);
    ASSERT_EQ(found.turns_rad.size(), 3U);
    EXPECT_NEAR(degrees(found.turns_rad[1]), 80, 0.1);
    EXPECT_NEAR(degrees(found.turns_rad[2]), 170, 0.1);
    const auto& lenses = std::get<DualFisheyeModel>(found.camera.model).lenses;
    const auto& truth = std::get<DualFisheyeModel>(camera.model).lenses;
    EXPECT_NEAR(lenses[1].gain / lenses[0].gain, 0.85, 0.01);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(lenses[i].centre_u_px, truth[i].centre_u_px, 0.3);
      EXPECT_NEAR(lenses[i].centre_v_px, truth[i].centre_v_px, 0.3);
      EXPECT_NEAR(degrees(lenses[i].elevation_rad), degrees(truth[i].elevation_rad), 0.2);
      EXPECT_NEAR(degrees(lenses[i].roll_rad), degrees(truth[i].roll_rad), 0.2);
      EXPECT_NEAR(degrees(lenses[i].max_angle_rad), degrees(truth[i].max_angle_rad), 2);
    }
    if (direction == ColumnDirection::clockwise) {
      EXPECT_EQ(found.camera,
                std::get<DualFisheyeCalibration>(calibrate(pictures, known, 1)).camera)
          << "threads changed it";
    }
  }
}

TEST(CalibrateDualFisheye, RefusesWhatDoesNotDetermineTheLenses) {
  const Camera camera = dual_fisheye_camera();
  DualFisheyeCalibration::Knowledge known;
  known.left_roll_rad = radians(90);
  known.right_roll_rad = radians(-90);
  const auto pictures = turned_pictures(camera, 5, {0, 90});

  Image blank(640, 320);
  EXPECT_TRUE(contains(reason(calibrate({blank, blank}, known)), "no circle of a lens"));
  Image noise(640, 320);
  Random random(1);
  for (auto& pixel : noise.pixels()) pixel = static_cast<std::uint8_t>(random.index(256));
  EXPECT_TRUE(contains(reason(calibrate({noise}, known)), "no circle of a lens"));
  // Circles, but nothing in them, or noise.
  const auto plain = render(
      camera, [](double, double) { return 0.5; }, 1);
  DualFisheyeCalibration::Knowledge turned = known;
  turned.turn_rad = radians(90);
  EXPECT_TRUE(contains(reason(calibrate({plain, plain}, turned)), "too little structure"));
  std::vector<Image> noisy = turned_pictures(camera, 5, {0, 90}, 0.0);
  for (Image& picture : noisy) {
    for (auto& pixel : picture.pixels()) {
      if (pixel > 0) pixel = static_cast<std::uint8_t>(1 + random.index(255));
    }
  }
  EXPECT_TRUE(contains(reason(calibrate(noisy, known)), "do not agree"));
  // One lens only, and a mirror.
  std::vector<Image> half = pictures;
  for (Image& picture : half) {
    for (int v = 0; v < 320; ++v) {
      for (int u = 320; u < 640; ++u) picture.at(u, v) = 0;
    }
  }
  EXPECT_TRUE(contains(reason(calibrate(half, known)), "no circle of a lens"));
  const auto mirror = render(mirror_camera(), wavy_world(3), 1);
  EXPECT_TRUE(contains(reason(calibrate({mirror}, known)), "no circle of a lens"));
  // Other places, wrong rolls, and a camera that was not turned.
  const auto elsewhere = turned_pictures(camera, 6, {90});
  EXPECT_TRUE(contains(reason(calibrate({pictures[0], elsewhere[0]}, known)), "do not agree"));
  EXPECT_TRUE(contains(reason(calibrate(pictures, {})), "do not agree"));
  EXPECT_TRUE(contains(reason(calibrate({pictures[0]}, known)), "uncertain"));
  EXPECT_TRUE(contains(reason(calibrate({pictures[0], pictures[0]}, known)), "not rotated"));

  EXPECT_THROW((void)calibrate({}, known), ContractError);
  EXPECT_THROW((void)calibrate({pictures[0], Image(640, 300)}, known), ContractError);
  EXPECT_THROW((void)calibrate({Image(100, 50)}, known), ContractError);
}

}  // namespace
}  // namespace panonav::testing
