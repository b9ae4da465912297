#include "panonav/pipeline/orientation_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "panonav/camera/camera.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

Camera equirectangular_camera() {
  Camera camera;
  camera.model = EquirectangularModel{radians(90.0), radians(-90.0)};
  camera.image_size = {640, 320};
  camera.forward_column = 0.8;
  return camera;
}

/// Azimuth of the column at a fraction of the width.
double azimuth_at(const PictureLayout& layout, double column) {
  const double sign = layout.direction == ColumnDirection::counter_clockwise ? 1.0 : -1.0;
  return wrap_angle(sign * 2.0 * std::numbers::pi * (column - layout.forward_column));
}

TEST(CorrectOrientation, OfAPanoramaGivesEachColumnItsTrueAzimuth) {
  for (const auto direction : {ColumnDirection::clockwise, ColumnDirection::counter_clockwise}) {
    for (const OrientationFault& fault : {OrientationFault{false, 1.0}, OrientationFault{true, 0.0},
                                          OrientationFault{true, -2.0}}) {
      const PictureSource stated{
          .layout = {.direction = direction, .forward_column = 0.3}, .camera = {}, .mask = {}};
      const PictureSource corrected = correct_orientation(stated, fault).value();
      EXPECT_GE(corrected.layout.forward_column, 0.0);
      EXPECT_LT(corrected.layout.forward_column, 1.0);
      for (const double column : {0.0, 0.2, 0.7}) {
        const double stated_rad = azimuth_at(stated.layout, column);
        const double true_rad = (fault.is_mirrored ? -stated_rad : stated_rad) + fault.turn_rad;
        EXPECT_NEAR(angle_difference(azimuth_at(corrected.layout, column), true_rad), 0.0, 1e-12);
      }
    }
  }
}

TEST(CorrectOrientation, OfACameraGivesEachPixelItsTrueDirection) {
  const OrientationFault fault{true, 0.7};
  for (const Camera& camera : {mirror_camera(), equirectangular_camera()}) {
    const PictureSource stated{
        .kind = PictureKind::mirror, .layout = {}, .camera = camera, .mask = {}};
    const Camera corrected = correct_orientation(stated, fault).value().camera.value();
    for (const double azimuth_rad : {-3.0, -1.0, 0.0, 2.0}) {
      const auto pixel = project(camera, Direction3::from_angles(azimuth_rad, -0.1));
      ASSERT_TRUE(pixel.has_value());
      const auto direction = unproject(corrected, *pixel);
      ASSERT_TRUE(direction.has_value());
      EXPECT_NEAR(angle_difference(direction->azimuth_rad(), fault.turn_rad - azimuth_rad), 0.0,
                  1e-9);
    }
  }
}

}  // namespace
}  // namespace panonav::testing
