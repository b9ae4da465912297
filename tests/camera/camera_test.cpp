#include "panonav/camera/camera.hpp"
#include "support/test_cameras.hpp"
#include "support/text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::testing {
namespace {

Camera mirror_camera(CameraModel model, double inner_px, double rim_px) {
  Camera camera;
  camera.model = std::move(model);
  camera.image_size = {640, 480};
  camera.centre = {322.25, 236.5};
  camera.inner_radius_px = inner_px;
  camera.rim_radius_px = rim_px;
  camera.forward_angle_rad = 0.7;
  return camera;
}

Camera equirectangular_camera(double bottom_rad, double top_rad) {
  Camera camera;
  camera.model = EquirectangularModel{bottom_rad, top_rad};
  camera.image_size = {1024, 300};
  camera.forward_column = 0.3;
  return camera;
}

struct NamedCamera {
  std::string name;
  Camera camera;
};

void PrintTo(const NamedCamera& named, std::ostream* os) {
  *os << named.name;
}

std::vector<NamedCamera> all_cameras() {
  Camera turned = mirror_camera(HyperboloidalModel{28.095, 23.4125, 500}, 30, 228);
  turned.direction = ColumnDirection::counter_clockwise;
  turned.forward_angle_rad = -2.9;
  Camera cut = mirror_camera(HyperboloidalModel{28.095, 23.4125, 500}, 25, 330);
  Camera counter_clockwise = equirectangular_camera(-0.6, 0.9);
  Camera stretched = mirror_camera(PolynomialModel{{-180, 0, 1.9e-3, 2e-6}}, 0, 225);
  stretched.affine = {0.98, 0.01, -0.02};
  Camera distorted = mirror_camera(UnifiedModel{1.3, 300}, 20, 210);
  distorted.affine = {1.01, 0.0, 0.003};
  distorted.distortion = {-0.12, 0.03, 0.002, -0.003, 0.001};
  counter_clockwise.direction = ColumnDirection::counter_clockwise;
  return {
      {"hyperboloidal", mirror_camera(HyperboloidalModel{28.095, 23.4125, 500}, 0, 230)},
      {"hyperboloidal_turned", turned},
      {"hyperboloidal_cut_by_frame", cut},
      {"hyperboloidal_flat", mirror_camera(HyperboloidalModel{30, 90, 1200}, 20, 200)},
      {"polynomial_mirror", mirror_camera(PolynomialModel{{220, 0, -2.6e-3, 1e-7}}, 15, 225)},
      {"polynomial_fisheye", mirror_camera(PolynomialModel{{-180, 0, 1.9e-3, 2e-6}}, 0, 230)},
      {"polynomial_linear", mirror_camera(PolynomialModel{{100, -0.7}}, 40, 200)},
      {"unified_hyperboloid", mirror_camera(UnifiedModel{0.9, 260}, 30, 229)},
      {"unified_paraboloid", mirror_camera(UnifiedModel{1.0, 180}, 0, 230)},
      {"unified_fisheye", mirror_camera(UnifiedModel{0.7, 150, UnifiedModel::Axis::up}, 0, 230)},
      {"unified_large_xi", mirror_camera(UnifiedModel{1.8, 400}, 10, 230)},
      {"unified_pinhole", mirror_camera(UnifiedModel{0.0, 200, UnifiedModel::Axis::up}, 0, 230)},
      {"equiangular", mirror_camera(EquiangularModel{-1.2, 0.4}, 35, 220)},
      {"equiangular_looking_up", mirror_camera(EquiangularModel{1.5, -0.2}, 5, 220)},
      {"fisheye",
       mirror_camera(FisheyeModel{140, 0.02, -0.003, 1e-3, -1e-4, 1.8, UnifiedModel::Axis::up}, 0,
                     230)},
      {"fisheye_looking_down", mirror_camera(FisheyeModel{120, -0.01, 0, 0, 0, 2.1}, 12, 230)},
      {"stretched", stretched},
      {"distorted", distorted},
      {"equirectangular", equirectangular_camera(-std::numbers::pi / 2, std::numbers::pi / 2)},
      {"panorama", equirectangular_camera(-0.5, 0.8)},
      {"panorama_counter_clockwise", counter_clockwise},
      {"dual_fisheye", dual_fisheye_camera()},
  };
}

double angle_between(const Direction3& a, const Direction3& b) {
  const Direction3 cross{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  return std::atan2(std::hypot(cross.x, cross.y, cross.z), a.x * b.x + a.y * b.y + a.z * b.z);
}

class EveryCamera : public ::testing::TestWithParam<NamedCamera> {
 protected:
  const Camera& camera() const { return GetParam().camera; }
};

INSTANTIATE_TEST_SUITE_P(Models, EveryCamera, ::testing::ValuesIn(all_cameras()),
                         [](const auto& test) { return test.param.name; });

TEST_P(EveryCamera, IsValid) {
  EXPECT_NO_THROW(validate(camera()));
}

TEST_P(EveryCamera, PixelToDirectionToPixel) {
  Random random(1);
  int seen = 0;
  double worst_px = 0;
  for (int i = 0; i < 20000; ++i) {
    const PixelPoint pixel{random.uniform(0, camera().image_size.width),
                           random.uniform(0, camera().image_size.height)};
    const auto direction = unproject(camera(), pixel);
    if (!direction) continue;
    ++seen;
    EXPECT_NEAR(std::hypot(direction->x, direction->y, direction->z), 1, 1e-12);
    const auto seen_again =
        project_all(camera(), *direction)[static_cast<std::size_t>(lens_at(camera(), pixel))];
    ASSERT_TRUE(seen_again) << pixel.u_px << " " << pixel.v_px;
    const PixelPoint* const again = &seen_again->pixel;
    // Near the poles of a full sphere all columns meet; there the distance is meant on the sphere.
    const double spread = std::holds_alternative<EquirectangularModel>(camera().model)
                              ? std::cos(direction->elevation_rad())
                              : 1.0;
    worst_px = std::max(worst_px,
                        std::hypot((again->u_px - pixel.u_px) * spread, again->v_px - pixel.v_px));
  }
  EXPECT_GT(seen, 4000);
  EXPECT_LT(worst_px, 1e-6);
}

TEST_P(EveryCamera, DirectionToPixelToDirection) {
  Random random(2);
  const ElevationBand band = visible_elevations(camera());
  ASSERT_LT(band.bottom_rad, band.top_rad);
  double worst_rad = 0;
  for (int i = 0; i < 20000; ++i) {
    const double azimuth_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    // The ends of the band themselves are visible, too.
    const double t = i % 10 == 0 ? 0 : i % 10 == 1 ? 1 : random.uniform();
    const double elevation_rad = band.bottom_rad * (1 - t) + band.top_rad * t;
    const double length = random.uniform(0.1, 50);
    const Direction3 unit = Direction3::from_angles(azimuth_rad, elevation_rad);
    const auto pixel = project(camera(), {unit.x * length, unit.y * length, unit.z * length});
    ASSERT_TRUE(pixel) << azimuth_rad << " " << elevation_rad;
    EXPECT_GE(pixel->u_px, 0);
    EXPECT_LE(pixel->u_px, camera().image_size.width);
    EXPECT_GE(pixel->v_px, 0);
    EXPECT_LE(pixel->v_px, camera().image_size.height);
    const auto again = unproject(camera(), *pixel);
    ASSERT_TRUE(again);
    worst_rad = std::max(worst_rad, angle_between(*again, unit));
  }
  EXPECT_LT(worst_rad, 1e-7);
}

TEST_P(EveryCamera, OutsideTheBandNothingIsSeen) {
  const ElevationBand band = visible_elevations(camera());
  if (GetParam().name == "hyperboloidal_cut_by_frame") {
    // The frame is nearest above the centre, at image angle pi/2; in its corners more is seen.
    const double up_rad = camera().forward_angle_rad - std::numbers::pi / 2;
    const double beyond_rad = band.top_rad + 1e-3;
    EXPECT_FALSE(project(camera(), Direction3::from_angles(up_rad, beyond_rad)));
    EXPECT_TRUE(
        project(camera(), Direction3::from_angles(up_rad + std::numbers::pi / 4, beyond_rad)));
    return;
  }
  int projected = 0;
  for (int i = 0; i < 360; ++i) {
    const double azimuth_rad = i * std::numbers::pi / 180;
    for (const double beyond_rad : {1e-4, 0.1, 0.5}) {
      for (const double elevation_rad : {band.bottom_rad - beyond_rad, band.top_rad + beyond_rad}) {
        if (std::abs(elevation_rad) > std::numbers::pi / 2) continue;
        ++projected;
        EXPECT_FALSE(project(camera(), Direction3::from_angles(azimuth_rad, elevation_rad)));
      }
    }
  }
  EXPECT_TRUE(projected > 300 ||
              band == (ElevationBand{-std::numbers::pi / 2, std::numbers::pi / 2}))
      << projected;
}

TEST_P(EveryCamera, NeverNotANumber) {
  const double inf = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> values{0.0, -0.0, 1.0, -1.0, 1e-320, -1e300, inf, -inf, nan, 240, 640};
  for (const double x : values) {
    for (const double y : values) {
      const auto direction = unproject(camera(), {x, y});
      if (direction) {
        EXPECT_TRUE(std::isfinite(direction->x + direction->y + direction->z)) << x << " " << y;
      }
      for (const double z : values) {
        const auto pixel = project(camera(), {x, y, z});
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
          EXPECT_FALSE(pixel);
        }
        if (pixel) {
          EXPECT_TRUE(std::isfinite(pixel->u_px + pixel->v_px));
        }
      }
    }
  }
  EXPECT_FALSE(project(camera(), {0, 0, 0}));
}

TEST_P(EveryCamera, OutsideTheImageNothingIsSeen) {
  const auto [width, height] = camera().image_size;
  EXPECT_FALSE(unproject(camera(), {-0.01, 10}));
  EXPECT_FALSE(unproject(camera(), {width + 0.01, 10}));
  EXPECT_FALSE(unproject(camera(), {10, -0.01}));
  EXPECT_FALSE(unproject(camera(), {10, height + 0.01}));
}

TEST_P(EveryCamera, ATurnOfTheRobotTurnsThePictureOnly) {
  // Mirror cameras: the picture of a direction turned by delta is the picture turned about the
  // centre.
  if (image_circle(camera(), 0).rim_radius_px == 0 || lens_count(camera()) == 2 ||
      camera().affine != Camera{}.affine) {
    GTEST_SKIP() << "not symmetric about one centre";
  }
  const ElevationBand band = visible_elevations(camera());
  const double elevation_rad = 0.5 * (band.bottom_rad + band.top_rad);
  const double sign = camera().direction == ColumnDirection::clockwise ? -1 : 1;
  const auto forward = project(camera(), Direction3::from_angles(0, elevation_rad));
  ASSERT_TRUE(forward);
  const double angle_rad =
      std::atan2(camera().centre.v_px - forward->v_px, forward->u_px - camera().centre.u_px);
  EXPECT_NEAR(wrap_angle(angle_rad - camera().forward_angle_rad), 0, 1e-12);
  const auto left = project(camera(), Direction3::from_angles(0.4, elevation_rad));
  ASSERT_TRUE(left);
  const double left_angle_rad =
      std::atan2(camera().centre.v_px - left->v_px, left->u_px - camera().centre.u_px);
  EXPECT_NEAR(wrap_angle(left_angle_rad - angle_rad - sign * 0.4), 0, 1e-12);
}

TEST(EquirectangularCamera, LeftOfForwardLiesLeftInAClockwisePicture) {
  Camera camera = equirectangular_camera(-0.5, 0.8);
  camera.forward_column = 0.5;
  const double width = camera.image_size.width;
  EXPECT_NEAR(project(camera, {1, 0, 0})->u_px, 0.5 * width, 1e-9);
  EXPECT_NEAR(project(camera, {0, 1, 0})->u_px, 0.25 * width, 1e-9);   // robot's left
  EXPECT_NEAR(project(camera, {0, -1, 0})->u_px, 0.75 * width, 1e-9);  // robot's right
  EXPECT_NEAR(project(camera, {1, 0, 0})->v_px, 0.8 / 1.3 * 300, 1e-9);
  camera.direction = ColumnDirection::counter_clockwise;
  EXPECT_NEAR(project(camera, {0, 1, 0})->u_px, 0.75 * width, 1e-9);
}

TEST(EquirectangularCamera, BothOuterEdgesLookTheSameWay) {
  const Camera camera = equirectangular_camera(-0.5, 0.8);
  const auto left = unproject(camera, {0, 100});
  const auto right = unproject(camera, {1024, 100});
  ASSERT_TRUE(left && right);
  EXPECT_LT(angle_between(*left, *right), 1e-12);
  EXPECT_NEAR(project(camera, *right)->u_px, 0, 1e-9);
}

TEST(VisibleElevations, EndAtTheFrameWhereItCutsTheMirror) {
  Camera camera = mirror_camera(EquiangularModel{-1.0, 0.5}, 50, 350);
  // Nearest border: 480 - 236.5 is below, 236.5 above.
  const double outer_px = 236.5;
  const ElevationBand band = visible_elevations(camera);
  EXPECT_NEAR(band.bottom_rad, -1.0, 1e-12);
  EXPECT_NEAR(band.top_rad, -1.0 + 1.5 * (outer_px - 50) / 300, 1e-12);
  camera.inner_radius_px = 240;
  EXPECT_THROW((void)visible_elevations(camera), ContractError);
}

TEST(VisibleElevations, OfADistortedPictureEndWhereTheFrameCutsIt) {
  Camera camera = mirror_camera(UnifiedModel{1.3, 300}, 20, 330);
  camera.distortion = {-0.12, 0.03, 0.002, -0.003, 0.0};
  const ElevationBand band = visible_elevations(camera);
  bool is_cut_above = false;
  for (int i = 0; i < 7200; ++i) {
    const double azimuth_rad = 2 * std::numbers::pi * i / 7200;
    EXPECT_TRUE(project(camera, Direction3::from_angles(azimuth_rad, band.top_rad)));
    const double above_rad = band.top_rad + 1e-3;
    is_cut_above |= !project(camera, Direction3::from_angles(azimuth_rad, above_rad));
  }
  EXPECT_TRUE(is_cut_above);
}

TEST(PolynomialFit, FollowsOtherModels) {
  const FisheyeModel fisheye{190, 0.003, 0.0007, -0.002, 0.0002, 1.95, UnifiedModel::Axis::up};
  const double rim_px = radius_at_angle(fisheye, 1.9);
  const auto fit = fit_polynomial(
      [&](double radius_px) { return elevation_at(fisheye, radius_px).value(); }, rim_px);
  EXPECT_LT(fit.residual_rad, 1e-5);
  EXPECT_NO_THROW(validate(fit.model, 0, rim_px));
  EXPECT_NEAR(elevation_at(fit.model, 0.3 * rim_px).value(),
              elevation_at(fisheye, 0.3 * rim_px).value(), fit.residual_rad + 1e-12);
  EXPECT_GT(fit_polynomial([](double r) { return r < 50 ? 1.0 : 0.5; }, 100).residual_rad, 0.01);
}

struct Fault {
  std::string field;
  std::function<void(Camera&)> make;
};

TEST(CameraValidation, NamesTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Camera good = mirror_camera(HyperboloidalModel{28.095, 23.4125, 500}, 10, 200);
  ASSERT_NO_THROW(validate(good));
  const std::vector<Fault> faults{
      {"image_size.width", [](Camera& c) { c.image_size.width = 0; }},
      {"image_size.height", [](Camera& c) { c.image_size.height = -3; }},
      {"centre.u_px", [](Camera& c) { c.centre.u_px = 640.1; }},
      {"centre.v_px", [&](Camera& c) { c.centre.v_px = nan; }},
      {"inner_radius_px", [](Camera& c) { c.inner_radius_px = -1; }},
      {"inner_radius_px", [&](Camera& c) { c.inner_radius_px = nan; }},
      {"rim_radius_px", [](Camera& c) { c.rim_radius_px = 10; }},
      {"rim_radius_px", [](Camera& c) { c.rim_radius_px = 601; }},  // f a / b = 600
      {"forward_angle_rad", [&](Camera& c) { c.forward_angle_rad = nan; }},
      {"affine", [&](Camera& c) { c.affine[1] = nan; }},
      {"affine",
       [](Camera& c) {
         c.affine = {0.5, 1.0, 0.5};
       }},
      {"distortion", [](Camera& c) { c.distortion[0] = 0.1; }},  // not of a hyperboloidal mirror
  };
  for (const Fault& fault : faults) {
    Camera camera = good;
    fault.make(camera);
    EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(camera); }), fault.field));
  }
  const std::vector<std::pair<std::string, CameraModel>> models{
      {"a_mm", HyperboloidalModel{0, 1, 1}},
      {"b_mm", HyperboloidalModel{1, nan, 1}},
      {"focal_length_px", HyperboloidalModel{1, 1, -500}},
      {"coefficients", PolynomialModel{}},
      {"coefficients", PolynomialModel{{100, nan}}},
      {"coefficients", PolynomialModel{{100, 0, 0.02}}},
      {"xi", UnifiedModel{-0.1, 300}},
      {"focal_length_px", UnifiedModel{1, 0}},
      {"rim_radius_px", UnifiedModel{2, 300}},
      {"focal_length_px", FisheyeModel{0}},
      {"k1 to k4", FisheyeModel{100, nan}},
      {"max_angle_rad", FisheyeModel{100, 0, 0, 0, 0, 3.2}},
      {"max_angle_rad", FisheyeModel{100, -0.2, 0, 0, 0, 1.5}},  // grows up to 1.29
      {"rim_radius_px", FisheyeModel{100, 0, 0, 0, 0, 1.5}},
      {"elevation_at_inner_rad", EquiangularModel{-2, 0}},
      {"elevation_at_rim_rad", EquiangularModel{0.1, 0.1}},
      {"elevation_bottom_rad", EquirectangularModel{-1.6, 1}},
      {"elevation_top_rad", EquirectangularModel{0.2, 0.1}},
  };
  for (const auto& [field, model] : models) {
    Camera camera = good;
    camera.model = model;
    EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(camera); }), field));
  }
  Camera folded = mirror_camera(UnifiedModel{1.0, 200}, 10, 200);
  folded.distortion[0] = -0.5;
  EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(folded); }),
                       "distortion: it folds the image at the radius"));
  Camera camera = equirectangular_camera(-0.5, 0.8);
  camera.forward_column = 1.5;
  EXPECT_TRUE(contains(message_of<ContractError>([&] { validate(camera); }), "forward_column"));
}

TEST(PolynomialModel, MonotonicOnlyInPartOfTheRangeIsRefused) {
  // f - r f' = 150 + 0.004 r^2 - 6e-5 r^3 changes its sign near r = 163.
  const PolynomialModel model{{150, 0, -0.004, 3e-5}};
  EXPECT_NO_THROW(validate(model, 0, 120));
  EXPECT_THROW(validate(model, 0, 200), ContractError);
  EXPECT_NO_THROW(validate(model, 180, 260));
  // A dip between two turning points, with the same sign at both ends.
  const PolynomialModel dip{{100, 0, 0.02, 0, -2.6e-7}};
  EXPECT_NO_THROW(validate(dip, 0, 60));
  EXPECT_THROW(validate(dip, 0, 250), ContractError);
}

}  // namespace
}  // namespace panonav::testing
