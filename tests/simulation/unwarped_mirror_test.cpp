// The mirror image, unwarped, against the panorama rendered directly: two independent ways from a
// scene to a cylinder.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/sensor.hpp"
#include "support/scene_views.hpp"

namespace panonav::simulation {
namespace {

// Returns the shift of `seen` to the left of `expected` in a sector of columns, to first order:
// least squares of their difference against the slope along the rows.
double shift_in_sector(const Panorama& seen, const Panorama& expected, int first, int columns) {
  double product = 0.0;
  double energy = 0.0;
  const int n = expected.columns();
  for (int y = 0; y < expected.rows(); ++y) {
    for (int c = first; c < first + columns; ++c) {
      const double slope = 0.5 * (expected.at(y, (c + 1) % n) - expected.at(y, (c + n - 1) % n));
      product += slope * (seen.at(y, c) - expected.at(y, c));
      energy += slope * slope;
    }
  }
  return product / energy;
}

struct Case {
  std::string scene;
  Pose2 pose;
};

class UnwarpedMirror : public ::testing::TestWithParam<Case> {};

/// `brightness`: of the camera's pictures.
void expect_agreement(const Case& place, const Camera& camera, const UnwarperOptions& options,
                      float brightness) {
  const Scene scene = make_scene(place.scene, {.seed = 3});
  Executor executor(2);
  const Renderer renderer(scene, {.shadows = false});
  const Viewpoint viewpoint{.pose = place.pose, .height_m = scene.camera_height_m};
  const Unwarper unwarper(camera, options);
  const Panorama direct = renderer.render_panorama(
      viewpoint,
      {.rows = 80, .columns = 512, .elevations = unwarper.elevations(), .rays_per_axis = 3},
      executor);
  const Radiance rendered = renderer.render_image(viewpoint, camera, 2, executor);
  const Image image = to_image(rendered);
  Panorama unwarped = unwarper.unwrap(image.view());
  for (float& value : unwarped.values()) value /= brightness;

  const auto reading = compass(compute_signature(unwarped, 64), compute_signature(direct, 64));
  ASSERT_TRUE(reading.has_value());
  EXPECT_GT(reading->correlation, 0.99);
  const double column_rad = 2.0 * std::numbers::pi / 512.0;
  EXPECT_LT(std::abs(reading->heading_rad), 0.1 * column_rad)
      << reading->heading_rad / column_rad << " columns";

  // The compass would not notice a mirror that is off centre: every side must agree by itself.
  for (int first = 0; first < 512; first += 64) {
    EXPECT_LT(std::abs(shift_in_sector(unwarped, direct, first, 64)), 0.1)
        << "columns from " << first;
  }
  const double noise = testing::mean_difference(apply_sensor(direct, {}, 1), direct);
  EXPECT_LT(testing::mean_difference(unwarped, direct), 1.5 * noise);
}

TEST_P(UnwarpedMirror, AgreesWithThePanorama) {
  expect_agreement(GetParam(), make_simulated_mirror_camera(), {}, 1.0F);
}

TEST_P(UnwarpedMirror, AndSoDoTwoLenses) {
  const Camera camera = make_simulated_dual_fisheye(3);
  const auto& lenses = std::get<DualFisheyeModel>(camera.model).lenses;
  EXPECT_NE(lenses[0].gain, lenses[1].gain);
  expect_agreement(GetParam(), camera, {.elevations = ElevationBand{-0.5, 0.7}},
                   static_cast<float>(std::min(lenses[0].gain, lenses[1].gain)));
}

INSTANTIATE_TEST_SUITE_P(Scenes, UnwarpedMirror,
                         ::testing::Values(Case{"office", {2.5, 1.0, 0.4}},
                                           Case{"office", {1.0, 0.5, -2.0}},
                                           Case{"lab", {3.0, 2.0, 1.5}},
                                           Case{"garden", {5.0, 4.0, 3.0}},
                                           Case{"arena", {0.3, 0.2, -1.0}}));

}  // namespace
}  // namespace panonav::simulation
