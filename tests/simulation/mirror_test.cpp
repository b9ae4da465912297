#include "panonav_simulation/mirror.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav::simulation {
namespace {

double dot(const Direction3& a, const Direction3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The reflected ray and the camera model's single viewpoint are two ways to the same line.
TEST(HyperboloidalMirror, ReflectedRayComesFromTheViewpointAsUnprojectSays) {
  Camera camera = make_simulated_mirror_camera();
  for (const ColumnDirection sense :
       {ColumnDirection::counter_clockwise, ColumnDirection::clockwise}) {
    camera.direction = sense;
    camera.forward_angle_rad = sense == ColumnDirection::clockwise ? 0.7 : -2.1;
    camera.centre = {322.3, 238.6};
    const HyperboloidalMirror mirror(camera);
    int seen = 0;
    for (int v = 0; v < 480; v += 7) {
      for (int u = 0; u < 640; u += 5) {
        const PixelPoint pixel{u + 0.5, v + 0.25};
        const MirrorRay ray = mirror.trace(pixel);
        const auto expected = unproject(camera, pixel);
        ASSERT_EQ(ray.target == MirrorTarget::world, expected.has_value()) << u << " " << v;
        if (!expected) continue;
        ++seen;
        EXPECT_NEAR(dot(ray.direction, *expected), 1.0, 1e-12);
        // The line through the point of reflection meets the viewpoint.
        const Direction3 origin{ray.origin.x_m, ray.origin.y_m, ray.origin.z_m};
        const double along = dot(origin, ray.direction);
        const double off = std::sqrt(std::max(0.0, dot(origin, origin) - along * along));
        EXPECT_LT(off, 1e-9);
        EXPECT_GT(along, 0.0);
      }
    }
    EXPECT_GT(seen, 3000);
  }
}

// Without the model: light goes from the world to the lens by the shortest way (Fermat), so the
// path over neighbouring points of the mirror is no shorter or longer to first order.
TEST(HyperboloidalMirror, PathOverTheMirrorIsStationary) {
  const Camera camera = make_simulated_mirror_camera();
  const auto model = std::get<HyperboloidalModel>(camera.model);
  const double c_mm = std::hypot(model.a_mm, model.b_mm);
  const HyperboloidalMirror mirror(camera);
  for (const double radius_px : {60.0, 110.0, 170.0, 220.0}) {
    const MirrorRay ray = mirror.trace({camera.centre.u_px + radius_px, camera.centre.v_px});
    ASSERT_EQ(ray.target, MirrorTarget::world);
    const double r = 1e3 * ray.origin.x_m;
    const double far_r = r + 500.0 * ray.direction.x;
    const double far_z = 1e3 * ray.origin.z_m + 500.0 * ray.direction.z;
    const auto path_mm = [&](double at_r) {
      const double z = model.b_mm * std::sqrt(1.0 + at_r * at_r / (model.a_mm * model.a_mm)) - c_mm;
      return std::hypot(at_r, z + 2.0 * c_mm) + std::hypot(far_r - at_r, far_z - z);
    };
    EXPECT_NEAR(1e3 * ray.origin.z_m,
                model.b_mm * std::sqrt(1.0 + r * r / (model.a_mm * model.a_mm)) - c_mm, 1e-9);
    const double slope = (path_mm(r + 1e-3) - path_mm(r - 1e-3)) / 2e-3;
    EXPECT_NEAR(slope, 0.0, 1e-6) << "at " << radius_px << " px";
  }
}

TEST(HyperboloidalMirror, MiddleShowsTheCameraAndTheOutsideTheHousing) {
  const Camera camera = make_simulated_mirror_camera();
  const HyperboloidalMirror mirror(camera);
  const auto target_at = [&](double radius_px) {
    return mirror.trace({camera.centre.u_px, camera.centre.v_px - radius_px}).target;
  };
  EXPECT_EQ(target_at(0.0), MirrorTarget::camera_body);
  EXPECT_EQ(target_at(camera.inner_radius_px - 0.5), MirrorTarget::camera_body);
  EXPECT_EQ(target_at(camera.inner_radius_px + 0.5), MirrorTarget::world);
  EXPECT_EQ(target_at(camera.rim_radius_px - 0.5), MirrorTarget::world);
  EXPECT_EQ(target_at(camera.rim_radius_px + 0.5), MirrorTarget::housing);
  EXPECT_GT(mirror.rim_radius_m(), mirror.body_radius_m());
}

TEST(HyperboloidalMirror, RefusesOtherModels) {
  Camera camera = make_simulated_mirror_camera();
  camera.model = EquiangularModel{-0.9, 0.3};
  EXPECT_THROW(HyperboloidalMirror{camera}, ContractError);
}

}  // namespace
}  // namespace panonav::simulation
