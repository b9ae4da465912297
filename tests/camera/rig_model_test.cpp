#include "panonav/camera/rig_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

TEST(RigModel, ProjectsWhereItsCamerasDo) {
  const Camera rig = rig_camera(4);
  const auto& model = std::get<RigModel>(rig.model);
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const auto direction =
        Direction3::from_angles(random.uniform(-4.0, 4.0), random.uniform(-0.4, 0.4));
    const auto pixel = project(rig, direction);
    ASSERT_TRUE(pixel.has_value());
    const RigModel::Tile tile = tile_at(model, pixel->u_px);
    const auto& lens = std::get<PinholeModel>(model.cameras[tile.camera].model);
    EXPECT_LE(std::abs(angle_difference(direction.azimuth_rad(), lens.azimuth_rad)),
              std::numbers::pi / 4 + 1e-9)
        << "the camera that looks there";
    const auto alone = project(model.cameras[tile.camera], direction);
    ASSERT_TRUE(alone.has_value());
    EXPECT_NEAR(pixel->u_px, tile.left_px + alone->u_px, 1e-5);
    EXPECT_EQ(pixel->v_px, alone->v_px);
    const auto back = unproject(rig, *pixel);
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(back->azimuth_rad(), wrap_angle(direction.azimuth_rad()), 1e-6);
    EXPECT_NEAR(back->elevation_rad(), direction.elevation_rad(), 1e-6);
  }
  EXPECT_FALSE(project(rig, {0.0, 0.0, 1.0}).has_value());
}

TEST(RigModel, SeesAllAzimuthsOrSaysThatItDoesNot) {
  const Camera around = rig_camera(4);
  EXPECT_TRUE(shows_all_azimuths(around));
  EXPECT_NEAR(field_of_view(around), 2.0 * std::numbers::pi, 1e-9);
  // The tangent of the elevation of a picture's upper edge falls with the cosine of the azimuth.
  // The band is found at every other degree, so at 44 degrees beside the corner.
  const double corner_rad = std::atan(0.75 * std::cos(radians(44.0)));
  const ElevationBand band = visible_elevations(around);
  EXPECT_LE(band.top_rad, corner_rad + 1e-9);
  EXPECT_GT(band.top_rad, corner_rad - radians(1.0));
  EXPECT_EQ(band.bottom_rad, -band.top_rad);
  const Camera front = rig_camera(3);
  EXPECT_FALSE(shows_all_azimuths(front));
  EXPECT_NEAR(field_of_view(front), radians(270.0), radians(1.5));
  EXPECT_THROW((void)visible_elevations(front), ContractError);
}

TEST(RigModel, JoinsPicturesSideBySide) {
  std::vector<Camera> cameras = std::get<RigModel>(rig_camera(3).model).cameras;
  cameras[1].image_size = {40, 20};
  cameras[1].centre = {20.0, 10.0};
  const Camera rig = make_rig(cameras);
  const auto& model = std::get<RigModel>(rig.model);
  const ImageSize first = cameras[0].image_size;
  EXPECT_EQ(rig.image_size.width, 2 * first.width + 40);
  EXPECT_EQ(rig.image_size.height, first.height);
  const Image grey(first.width, first.height, 1,
                   std::vector<std::uint8_t>(first.width * first.height, 7));
  Image red(40, 20, 3);
  for (int v = 0; v < 20; ++v) {
    for (int u = 0; u < 40; ++u) red.at(u, v) = 200;
  }
  const std::vector<ImageView> views{grey.view(), red.view(), grey.view()};
  const Image joined = join_pictures(model, views);
  ASSERT_EQ(joined.size(), rig.image_size);
  ASSERT_EQ(joined.channels(), 3);
  EXPECT_EQ(joined.at(0, 0, 2), 7);
  EXPECT_EQ(joined.at(first.width - 1, first.height - 1, 1), 7);
  EXPECT_EQ(joined.at(first.width, 19, 0), 200);
  EXPECT_EQ(joined.at(first.width, 19, 1), 0);
  EXPECT_EQ(joined.at(first.width + 39, 20, 0), 0) << "below the lower picture";
  EXPECT_EQ(joined.at(first.width + 40, 20, 0), 7);
  EXPECT_EQ(tile_at(model, first.width + 39.9).camera, 1U);
  EXPECT_EQ(tile_at(model, 1e6).camera, 2U);
  EXPECT_THROW((void)join_pictures(model, std::span(views).first(2)), ContractError);
  const std::vector<ImageView> exchanged{grey.view(), grey.view(), red.view()};
  EXPECT_THROW((void)join_pictures(model, exchanged), ContractError);
}

TEST(RigModel, RefusesCamerasThatMakeNoRig) {
  const std::vector<Camera> cameras = std::get<RigModel>(rig_camera(4).model).cameras;
  EXPECT_THROW((void)make_rig({cameras[0]}), ContractError);
  EXPECT_THROW((void)make_rig(std::vector<Camera>(9, cameras[0])), ContractError);
  EXPECT_THROW((void)make_rig({cameras[0], rig_camera(2)}), ContractError);
  std::vector<Camera> damaged = cameras;
  std::get<PinholeModel>(damaged[2].model).focal_length_px = -1.0;
  try {
    (void)make_rig(damaged);
    FAIL();
  } catch (const ContractError& error) {
    EXPECT_NE(std::string(error.what()).find("camera 2 of the rig"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("focal_length_px"), std::string::npos);
  }
  Camera wrong_size = rig_camera(4);
  wrong_size.image_size.width += 1;
  EXPECT_THROW(validate(wrong_size), ContractError);
}

}  // namespace
}  // namespace panonav::testing
