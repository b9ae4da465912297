#include "panonav/camera/hyperboloidal_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/camera/unified_model.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

struct Vector {
  double x = 0.0;  ///< away from the axis
  double z = 0.0;  ///< up
};

/// The elevation seen at `radius_px` by following the light backwards in the plane of the axis:
/// from the lens in (0, -c) to the mirror, then by the law of reflection at the surface's normal.
/// Nothing here uses the foci's property; negative when the ray misses the mirror.
struct Traced {
  bool hit = false;
  double elevation_rad = 0.0;
  double distance_to_focus = 0.0;  ///< of the reflected ray's line, in mm
};
Traced trace(double a, double b, double f, double radius_px) {
  const double c = std::sqrt(a * a + b * b);
  const double length = std::hypot(radius_px, f);
  const Vector ray{radius_px / length, f / length};
  // (t x)^2 / a^2 - (t z - c)^2 / b^2 = -1
  const double p = ray.x * ray.x / (a * a) - ray.z * ray.z / (b * b);
  const double q = 2 * ray.z * c / (b * b);
  const double s = -c * c / (b * b) + 1;
  const double discriminant = q * q - 4 * p * s;
  if (discriminant < 0) return {};
  for (const double root :
       {(-q + std::sqrt(discriminant)) / (2 * p), (-q - std::sqrt(discriminant)) / (2 * p)}) {
    const Vector hit{root * ray.x, root * ray.z - c};
    if (root <= 0 || hit.z <= 0) continue;
    Vector normal{hit.x / (a * a), -hit.z / (b * b)};
    const double norm = std::hypot(normal.x, normal.z);
    normal = {normal.x / norm, normal.z / norm};
    const double along = ray.x * normal.x + ray.z * normal.z;
    const Vector out{ray.x - 2 * along * normal.x, ray.z - 2 * along * normal.z};
    const double off = std::abs((hit.x - 0) * out.z - (hit.z - c) * out.x);
    return {true, std::atan2(out.z, out.x), off};
  }
  return {};
}

TEST(HyperboloidalModel, AgreesWithARayTracedThroughTheMirror) {
  Random random(3);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const HyperboloidalModel model{random.uniform(5, 60), random.uniform(5, 60),
                                   random.uniform(100, 2000)};
    const double limit_px = model.focal_length_px * model.a_mm / model.b_mm;
    const double radius_px = random.uniform(0, 1.2) * limit_px;
    const Traced traced = trace(model.a_mm, model.b_mm, model.focal_length_px, radius_px);
    const auto elevation_rad = elevation_at(model, radius_px);
    // At the limit itself rounding decides.
    if (std::abs(radius_px / limit_px - 1) < 1e-6) continue;
    ASSERT_EQ(elevation_rad.has_value(), traced.hit) << radius_px / limit_px;
    if (!traced.hit) continue;
    ++hits;
    EXPECT_NEAR(*elevation_rad, traced.elevation_rad, 1e-7);
    EXPECT_NEAR(*radius_at(model, traced.elevation_rad), radius_px, 1e-6 * limit_px);
  }
  EXPECT_GT(hits, 3000);
}

TEST(HyperboloidalModel, ReflectedRaysMeetInTheFocus) {
  const HyperboloidalModel model;
  for (double radius_px = 0; radius_px < 590; radius_px += 10) {
    const Traced traced = trace(model.a_mm, model.b_mm, model.focal_length_px, radius_px);
    ASSERT_TRUE(traced.hit);
    EXPECT_LT(traced.distance_to_focus, 1e-8);
  }
}

TEST(HyperboloidalModel, LooksStraightDownInTheMiddleAndUpToTheAsymptote) {
  const HyperboloidalModel model{30, 40, 300};
  EXPECT_NEAR(*elevation_at(model, 0), -std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(*radius_at(model, -std::numbers::pi / 2), 0, 1e-9);
  EXPECT_NEAR(*elevation_at(model, 225 * (1 - 1e-12)), std::atan2(40, 30), 1e-6);
  EXPECT_FALSE(elevation_at(model, 225));
  EXPECT_FALSE(elevation_at(model, -1));
  EXPECT_FALSE(radius_at(model, std::atan2(40, 30) + 1e-12));
  EXPECT_FALSE(radius_at(model, std::nan("")));
}

TEST(HyperboloidalModel, HorizonRadius) {
  const HyperboloidalModel model;
  const double a = model.a_mm;
  const double b = model.b_mm;
  const double c = std::hypot(a, b);
  const double radius_px = a * a * model.focal_length_px / (2 * b * c);
  EXPECT_NEAR(*radius_at(model, 0), radius_px, 1e-9);
  EXPECT_NEAR(*elevation_at(model, radius_px), 0, 1e-12);
}

TEST(HyperboloidalModel, IsAUnifiedModel) {
  // Geyer and Daniilidis: xi = 2 b c / (b^2 + c^2), focal length scaled by a^2 / (b^2 + c^2).
  const HyperboloidalModel mirror{28.095, 23.4125, 500};
  const double a = mirror.a_mm;
  const double b = mirror.b_mm;
  const double c = std::hypot(a, b);
  const UnifiedModel unified{2 * b * c / (b * b + c * c),
                             mirror.focal_length_px * a * a / (b * b + c * c),
                             UnifiedModel::Axis::down};
  for (double radius_px = 0; radius_px < 590; radius_px += 5) {
    EXPECT_NEAR(*elevation_at(mirror, radius_px), *elevation_at(unified, radius_px), 1e-9);
  }
}

}  // namespace
}  // namespace panonav
