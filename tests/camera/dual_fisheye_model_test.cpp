#include "panonav/camera/dual_fisheye_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "panonav/camera/camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/test_cameras.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

const DualFisheyeModel& lenses_of(const Camera& camera) {
  return std::get<DualFisheyeModel>(camera.model);
}

TEST(DualFisheye, RollTurnsWhatIsAboveCounterClockwiseInThePicture) {
  FisheyeLens lens;
  lens.azimuth_rad = 0.4;
  lens.roll_rad = std::numbers::pi / 2;
  const Direction3 above = Direction3::from_angles(0.4, 0.3);
  const auto seen = project(lens, FisheyeLens::Rotation(lens).lens_from_robot(above));
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->right_px, -0.3 * lens.focal_length_px, 1e-9);
  EXPECT_NEAR(seen->up_px, 0, 1e-9);
  lens.roll_rad = 0;
  const auto left =
      project(lens, FisheyeLens::Rotation(lens).lens_from_robot(Direction3::from_angles(0.5, 0)));
  EXPECT_NEAR(left->right_px, -0.1 * lens.focal_length_px, 1e-9) << "left in the world, unmirrored";
}

TEST(DualFisheye, AMirroredPictureIsTheSameTurnedAround) {
  const Camera plain = dual_fisheye_camera();
  Camera mirrored = plain;
  mirrored.direction = ColumnDirection::counter_clockwise;
  const Direction3 direction = Direction3::from_angles(0.3, 0.1);
  const double centre = lenses_of(plain).lenses[0].centre_u_px;
  EXPECT_NEAR(project(plain, direction)->u_px - centre, centre - project(mirrored, direction)->u_px,
              1e-9);
}

TEST(DualFisheye, WeightsAddUpToOneAndAreContinuous) {
  const Camera camera = dual_fisheye_camera();
  Random random(3);
  int both = 0;
  for (int i = 0; i < 3000; ++i) {
    // A way round the sphere on any great circle, in steps of a tenth of a degree.
    const Direction3 a = Direction3::from_angles(random.uniform(-3.1, 3.1), random.uniform(-1, 1));
    const auto here = project_all(camera, a);
    const auto beside = project_all(
        camera, Direction3::from_angles(a.azimuth_rad() + radians(0.1), a.elevation_rad()));
    double sum = 0;
    for (std::size_t lens = 0; lens < 2; ++lens) {
      const double weight = here[lens] ? here[lens]->weight : 0;
      const double next = beside[lens] ? beside[lens]->weight : 0;
      sum += weight;
      both += weight > 0 && weight < 1 ? 1 : 0;
      EXPECT_LT(std::abs(next - weight), 0.1) << a.azimuth_rad() << " " << a.elevation_rad();
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  EXPECT_GT(both, 50) << "no seam was met";
  EXPECT_DOUBLE_EQ(blend_share(0.1, 0.1), 0.5);
  EXPECT_EQ(blend_share(0.0, 0.2), 0.0) << "what a lens hardly sees does not count";
  EXPECT_EQ(blend_share(0.2, 0.0), 1.0);
}

TEST(DualFisheye, SeesTheWholeSphereOrSaysThatAGapIsLeft) {
  Camera camera = dual_fisheye_camera();
  const ElevationBand band = visible_elevations(camera);
  EXPECT_NEAR(band.top_rad, std::numbers::pi / 2, 1e-9);
  EXPECT_NEAR(band.bottom_rad, -std::numbers::pi / 2, 1e-9);
  for (FisheyeLens& lens : std::get<DualFisheyeModel>(camera.model).lenses) {
    lens.max_angle_rad = radians(85);
  }
  const auto error = message_of<ContractError>([&] { (void)visible_elevations(camera); });
  EXPECT_TRUE(contains(error, "max_angle_rad")) << error;
}

TEST(DualFisheye, FaultsNameLensFieldAndRange) {
  const auto error_with = [](const std::function<void(FisheyeLens&)>& change) {
    Camera camera = dual_fisheye_camera();
    change(std::get<DualFisheyeModel>(camera.model).lenses[1]);
    return message_of<ContractError>([&] { validate(camera); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(
      contains(error_with([](auto& lens) { lens.centre_u_px = 10; }), "lens1_centre_u_px is 10"));
  EXPECT_TRUE(
      contains(error_with([&](auto& lens) { lens.centre_v_px = nan; }), "lens1_centre_v_px"));
  EXPECT_TRUE(
      contains(error_with([](auto& lens) { lens.focal_length_px = 0; }), "focal_length_px"));
  EXPECT_TRUE(contains(error_with([](auto& lens) { lens.max_angle_rad = 3.2; }), "max_angle_rad"));
  EXPECT_TRUE(contains(error_with([](auto& lens) { lens.elevation_rad = 2; }), "elevation_rad"));
  EXPECT_TRUE(contains(error_with([](auto& lens) { lens.gain = 0; }), "lens1_gain is 0"));
  EXPECT_TRUE(contains(error_with([](auto& lens) { lens.k3 = -0.2; }), "radius stops growing"));
  // Falls and rises again within the field of view.
  EXPECT_TRUE(contains(error_with([](auto& lens) {
                         lens.k3 = -0.6;
                         lens.k5 = 0.15;
                       }),
                       "radius stops growing"));
}

}  // namespace
}  // namespace panonav::testing
