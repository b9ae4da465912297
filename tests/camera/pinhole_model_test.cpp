#include "panonav/camera/pinhole_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/camera/camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

Camera pinhole_camera(const PinholeModel& model) {
  Camera camera;
  camera.model = model;
  camera.image_size = {640, 480};
  camera.centre = {322.25, 236.5};
  return camera;
}

TEST(PinholeModel, PixelToDirectionToPixel) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Camera camera = pinhole_camera({.focal_length_px = random.uniform(200.0, 900.0),
                                          .azimuth_rad = random.uniform(-3.0, 3.0),
                                          .elevation_rad = random.uniform(-1.0, 1.0),
                                          .roll_rad = random.uniform(-3.0, 3.0)});
    ASSERT_NO_THROW(validate(camera));
    const PixelPoint pixel{random.uniform(0.0, 640.0), random.uniform(0.0, 480.0)};
    const auto direction = unproject(camera, pixel);
    ASSERT_TRUE(direction);
    EXPECT_NEAR(std::hypot(direction->x, direction->y, direction->z), 1.0, 1e-12);
    const auto again = project(camera, *direction);
    ASSERT_TRUE(again);
    EXPECT_NEAR(again->u_px, pixel.u_px, 1e-8);
    EXPECT_NEAR(again->v_px, pixel.v_px, 1e-8);
    // The opposite direction is behind the lens.
    EXPECT_FALSE(project(camera, {-direction->x, -direction->y, -direction->z}));
  }
}

TEST(PinholeModel, AxesOfThePicture) {
  const Camera camera = pinhole_camera({.focal_length_px = 100.0, .azimuth_rad = 0.5});
  const auto middle = unproject(camera, camera.centre);
  EXPECT_NEAR(middle->azimuth_rad(), 0.5, 1e-12);
  EXPECT_NEAR(middle->elevation_rad(), 0.0, 1e-12);
  // Right in the picture is clockwise, down is below the horizon.
  EXPECT_NEAR(unproject(camera, {422.25, 236.5})->azimuth_rad(), 0.5 - radians(45.0), 1e-12);
  EXPECT_NEAR(unproject(camera, {322.25, 336.5})->elevation_rad(), -radians(45.0), 1e-12);
}

TEST(PinholeModel, FieldOfView) {
  Camera camera = pinhole_camera({.focal_length_px = 320.0, .azimuth_rad = 3.0, .roll_rad = 0.4});
  camera.centre = {320.0, 240.0};
  EXPECT_NEAR(field_of_view(camera), radians(90.0), 1e-9);
  // Barrel distortion shows more.
  camera.distortion = {-0.1, 0.0, 0.0, 0.0, 0.0};
  camera.rim_radius_px = 500.0;
  ASSERT_NO_THROW(validate(camera));
  EXPECT_GT(field_of_view(camera), radians(94.0));
  camera.rim_radius_px = 200.0;  // nothing is seen beyond
  EXPECT_NEAR(field_of_view(camera), 2.0 * std::atan(200.0 / 320.0), 0.01);
  EXPECT_EQ(field_of_view(Camera{}), 0.0);
}

TEST(PinholeModel, FocalLengths) {
  EXPECT_NEAR(focal_length_from_field_of_view(640, radians(90.0)), 320.0, 1e-9);
  // A picture of 3:2 is film of 36 x 24 mm.
  EXPECT_NEAR(focal_length_from_35mm({3600, 2400}, 26.0), 2600.0, 1e-9);
  EXPECT_NEAR(focal_length_from_35mm({2400, 3600}, 26.0), 2600.0, 1e-9);
  EXPECT_THROW((void)focal_length_from_field_of_view(640, radians(180.0)), ContractError);
  EXPECT_THROW((void)focal_length_from_35mm({640, 480}, 0.0), ContractError);
}

TEST(PinholeModel, FaultsAreNamed) {
  const auto fault = [](const PinholeModel& model) {
    return message_of<ContractError>([&] { validate(pinhole_camera(model)); });
  };
  EXPECT_TRUE(contains(fault({.focal_length_px = 0.0}), "focal_length_px"));
  EXPECT_TRUE(contains(fault({.elevation_rad = 2.0}), "elevation_rad"));
  EXPECT_TRUE(contains(fault({.roll_rad = std::numeric_limits<double>::infinity()}), "roll_rad"));
  Camera distorted = pinhole_camera({});
  distorted.distortion = {-0.3, 0.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(distorted); }), "rim_radius_px"));
  distorted.rim_radius_px = 2000.0;  // folded far within
  EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(distorted); }), "folds"));
  Camera outside = pinhole_camera({});
  outside.centre.u_px = 700.0;
  EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(outside); }), "centre.u_px"));
  EXPECT_TRUE(
      contains(message_of<ContractError>([] { (void)visible_elevations(pinhole_camera({})); }),
               "all azimuths"));
}

}  // namespace
}  // namespace panonav::testing
