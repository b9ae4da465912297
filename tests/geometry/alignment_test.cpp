#include "panonav/geometry/alignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

using Points = std::vector<Point2>;

Points random_points(Random& random, std::size_t count) {
  Points points(count);
  for (auto& p : points) p = {random.uniform(-4.0, 4.0), random.uniform(-2.0, 2.0)};
  return points;
}

Points moved(const Points& points, double scale, double rotation_rad, Point2 shift, bool mirrored) {
  const Alignment map{scale, rotation_rad, shift, mirrored, 0.0};
  Points result;
  for (const auto& p : points) result.push_back(map.apply(p));
  return result;
}

Point2 centroid(const Points& points) {
  Point2 c;
  for (const auto& p : points) c = {c.x_m + p.x_m, c.y_m + p.y_m};
  return {c.x_m / static_cast<double>(points.size()), c.y_m / static_cast<double>(points.size())};
}

double rms(const Points& a, const Points& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(distance(a[i], b[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// Oracle: all rotations on a fine grid about the centroid, both handednesses, scale by least
// squares.
double brute_force_rms(const Points& from, const Points& to, bool allow_scale,
                       bool allow_reflection) {
  const Point2 a = centroid(from);
  const Point2 b = centroid(to);
  double best = 1e300;
  for (const bool mirrored : {false, true}) {
    if (mirrored && !allow_reflection) continue;
    for (int step = 0; step < 7200; ++step) {
      const double angle = 2.0 * std::numbers::pi * step / 7200;
      Points centred;
      for (const auto& p : from) centred.push_back({p.x_m - a.x_m, p.y_m - a.y_m});
      Points turned = moved(centred, 1.0, angle, {}, mirrored);
      double scale = 1.0;
      if (allow_scale) {
        double dot = 0.0;
        double norm2 = 0.0;
        for (std::size_t i = 0; i < turned.size(); ++i) {
          dot += turned[i].x_m * (to[i].x_m - b.x_m) + turned[i].y_m * (to[i].y_m - b.y_m);
          norm2 += turned[i].x_m * turned[i].x_m + turned[i].y_m * turned[i].y_m;
        }
        scale = std::max(0.0, dot / norm2);
      }
      for (auto& p : turned) p = {scale * p.x_m + b.x_m, scale * p.y_m + b.y_m};
      best = std::min(best, rms(turned, to));
    }
  }
  return best;
}

TEST(Align, RecoversAKnownMotion) {
  Random random(31);
  for (int trial = 0; trial < 200; ++trial) {
    const Points from = random_points(random, 3 + random.index(20));
    const double scale = random.uniform(0.2, 4.0);
    const double rotation = random.uniform(-3.1, 3.1);
    const Point2 shift{random.uniform(-9, 9), random.uniform(-9, 9)};
    const bool mirrored = trial % 2 == 1;
    const Alignment found = align(from, moved(from, scale, rotation, shift, mirrored),
                                  {.allow_scale = true, .allow_reflection = true});
    EXPECT_NEAR(found.scale, scale, 1e-9);
    EXPECT_NEAR(angle_difference(found.rotation_rad, rotation), 0.0, 1e-9);
    EXPECT_NEAR(distance(found.translation, shift), 0.0, 1e-9);
    EXPECT_EQ(found.reflected, mirrored);
    EXPECT_NEAR(found.rms_m, 0.0, 1e-9);
  }
}

TEST(Align, IsAsGoodAsBruteForce) {
  Random random(32);
  for (int trial = 0; trial < 12; ++trial) {
    const Points from = random_points(random, 6);
    const Points to = random_points(random, 6);
    const Alignment::Options options{.allow_scale = trial % 2 == 1,
                                     .allow_reflection = trial % 4 >= 2};
    const Alignment found = align(from, to, options);
    const double oracle = brute_force_rms(from, to, options.allow_scale, options.allow_reflection);
    EXPECT_LE(found.rms_m, oracle + 1e-12);
    EXPECT_NEAR(found.rms_m, oracle, 1e-5);
    Points applied;
    for (const auto& p : from) applied.push_back(found.apply(p));
    EXPECT_NEAR(rms(applied, to), found.rms_m, 1e-12);
  }
}

TEST(Align, OfOnePointOrCoincidentPointsIsATranslation) {
  const Alignment one = align(Points{{1, 2}}, Points{{4, 6}}, {.allow_scale = true});
  EXPECT_EQ(one.rms_m, 0.0);
  EXPECT_NEAR(distance(one.apply({1, 2}), {4, 6}), 0.0, 1e-12);
  const Alignment same = align(Points{{1, 1}, {1, 1}}, Points{{0, 0}, {2, 0}});
  EXPECT_NEAR(distance(same.apply({1, 1}), {1, 0}), 0.0, 1e-12);
  EXPECT_NEAR(same.rms_m, 1.0, 1e-12);
}

TEST(Align, RefusesSetsThatDoNotMatch) {
  EXPECT_THROW((void)align(Points{}, Points{}), ContractError);
  EXPECT_THROW((void)align(Points{{0, 0}}, Points{}), ContractError);
}

// Singular values of the 2 x 2 product of the centred unit-norm sets, in closed form.
ShapeDifference oracle_shape_difference(const Points& a, const Points& b) {
  const Point2 ca = centroid(a);
  const Point2 cb = centroid(b);
  double na = 0.0, nb = 0.0;
  double m[2][2] = {{0, 0}, {0, 0}};
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double p[2] = {a[i].x_m - ca.x_m, a[i].y_m - ca.y_m};
    const double q[2] = {b[i].x_m - cb.x_m, b[i].y_m - cb.y_m};
    for (int r = 0; r < 2; ++r) {
      na += p[r] * p[r];
      nb += q[r] * q[r];
      for (int c = 0; c < 2; ++c) m[r][c] += p[r] * q[c];
    }
  }
  const double norm = std::sqrt(na * nb);
  const double determinant = (m[0][0] * m[1][1] - m[0][1] * m[1][0]) / (norm * norm);
  double frobenius2 = 0.0;
  for (const auto& row : m) frobenius2 += (row[0] * row[0] + row[1] * row[1]) / (norm * norm);
  // (s1 + s2)^2 = |M|_F^2 + 2 |det M|, and d carries the sign of det M.
  const double proper = frobenius2 + 2.0 * determinant;
  const double mirrored = frobenius2 + 2.0 * std::abs(determinant);
  return {1.0 - proper, 1.0 - mirrored};
}

TEST(ShapeDifference, AgreesWithTheSingularValues) {
  Random random(33);
  for (int trial = 0; trial < 300; ++trial) {
    const Points a = random_points(random, 2 + random.index(12));
    const Points b = random_points(random, a.size());
    const ShapeDifference found = shape_difference(a, b);
    const ShapeDifference expected = oracle_shape_difference(a, b);
    EXPECT_NEAR(found.value, expected.value, 1e-12);
    EXPECT_NEAR(found.with_reflection, expected.with_reflection, 1e-12);
    EXPECT_GE(found.value, found.with_reflection);
    EXPECT_GE(found.with_reflection, 0.0);
    EXPECT_LE(found.value, 1.0);
  }
}

TEST(ShapeDifference, IgnoresPositionTurnAndSizeButNotHandedness) {
  Random random(34);
  for (int trial = 0; trial < 100; ++trial) {
    const Points a = random_points(random, 10);
    const Points turned = moved(a, random.uniform(0.1, 9.0), random.uniform(-3, 3), {5, -7}, false);
    EXPECT_NEAR(shape_difference(a, turned).value, 0.0, 1e-12);
    const ShapeDifference mirrored = shape_difference(a, moved(a, 2.0, 1.0, {1, 1}, true));
    EXPECT_GT(mirrored.value, 1e-3);
    EXPECT_NEAR(mirrored.with_reflection, 0.0, 1e-12);
    const Points b = random_points(random, 10);
    EXPECT_NEAR(shape_difference(a, b).value, shape_difference(b, a).value, 1e-12);
  }
}

TEST(ShapeDifference, RefusesShapesWithoutExtent) {
  EXPECT_THROW((void)shape_difference(Points{{0, 0}}, Points{{0, 0}}), ContractError);
  EXPECT_THROW((void)shape_difference(Points{{0, 0}, {0, 0}}, Points{{0, 0}, {1, 0}}),
               ContractError);
  EXPECT_THROW((void)shape_difference(Points{{0, 0}, {1, 0}}, Points{{0, 0}}), ContractError);
}

using Points3 = std::vector<Point3>;

Points3 random_points3(Random& random, std::size_t count) {
  Points3 points(count);
  for (auto& p : points) {
    p = {random.uniform(-4.0, 4.0), random.uniform(-2.0, 2.0), random.uniform(-3.0, 3.0)};
  }
  return points;
}

Rotation3 random_rotation(Random& random) {
  Rotation3 q{random.normal(0, 1), random.normal(0, 1), random.normal(0, 1), random.normal(0, 1)};
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w / length, q.x / length, q.y / length, q.z / length};
}

Points3 transformed(const Alignment3& map, const Points3& points) {
  Points3 result;
  for (const Point3& p : points) result.push_back(map.apply(p));
  return result;
}

double rms(const Points3& a, const Points3& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(distance(a[i], b[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(Rotation3, ComposesAndInvertsAsMatricesDo) {
  Random random(3);
  for (int round = 0; round < 50; ++round) {
    const Rotation3 a = random_rotation(random);
    const Rotation3 b = random_rotation(random);
    const Point3 p{random.normal(0, 1), random.normal(0, 1), random.normal(0, 1)};
    EXPECT_NEAR(distance((a * b) * p, a * (b * p)), 0.0, 1e-12);
    EXPECT_NEAR(distance(inverse(a) * (a * p), p), 0.0, 1e-12);
    const Point3 x = a * Point3{1, 0, 0};
    const Point3 y = a * Point3{0, 1, 0};
    const Point3 z = a * Point3{0, 0, 1};
    const auto same =
        Rotation3::from_matrix({x.x_m, y.x_m, z.x_m, x.y_m, y.y_m, z.y_m, x.z_m, y.z_m, z.z_m});
    EXPECT_NEAR((inverse(a) * same).angle_rad(), 0.0, 1e-7);
    EXPECT_NEAR(a.yaw_rad(), std::atan2(x.y_m, x.x_m), 1e-12);
  }
  EXPECT_NEAR(Rotation3::from_yaw(-2.5).angle_rad(), 2.5, 1e-12);
  EXPECT_NEAR(Rotation3::from_yaw(-2.5).yaw_rad(), -2.5, 1e-12);
}

TEST(Alignment3, FindsEverySimilarityOfSpace) {
  Random random(11);
  for (int round = 0; round < 100; ++round) {
    const Points3 from = random_points3(random, 8);
    const Alignment3 map{
        random.uniform(0.2, 5.0), random_rotation(random), {4, -7, 2}, false, true};
    const Points3 to = transformed(map, from);
    const Alignment3 found = align_in_space(from, to, {.allow_scale = true});
    EXPECT_TRUE(found.is_unique);
    EXPECT_NEAR(found.scale, map.scale, 1e-9);
    EXPECT_LT(rms(transformed(found, from), to), 1e-9);
    EXPECT_NEAR((inverse(found.rotation) * map.rotation).angle_rad(), 0.0, 1e-7);
    EXPECT_GT(rms(transformed(align_in_space(from, to), from), to),
              1e-3);  // the scale is not allowed
  }
}

TEST(Alignment3, NoSmallChangeIsBetter) {
  Random random(12);
  for (int round = 0; round < 40; ++round) {
    const Points3 from = random_points3(random, 6);
    const Points3 to = random_points3(random, 6);
    const bool allow_scale = round % 2 == 0;
    const Alignment3 found = align_in_space(from, to, {.allow_scale = allow_scale});
    const double found_rms = rms(transformed(found, from), to);
    for (int change = 0; change < 30; ++change) {
      Alignment3 other = found;
      const Rotation3 small{1.0, random.normal(0, 1e-3), random.normal(0, 1e-3),
                            random.normal(0, 1e-3)};
      const double length =
          std::sqrt(1.0 + small.x * small.x + small.y * small.y + small.z * small.z);
      other.rotation =
          Rotation3{small.w / length, small.x / length, small.y / length, small.z / length} *
          found.rotation;
      other.translation.x_m += random.normal(0, 1e-3);
      if (allow_scale) other.scale *= 1.0 + random.normal(0, 1e-3);
      EXPECT_GE(rms(transformed(other, from), to), found_rms - 1e-12);
    }
  }
}

TEST(Alignment3, MirrorsOnlyWhenAllowed) {
  Random random(13);
  const Points3 from = random_points3(random, 9);
  const Alignment3 map{1.0, random_rotation(random), {1, 2, 3}, true, true};
  const Points3 to = transformed(map, from);
  const Alignment3 proper = align_in_space(from, to);
  EXPECT_FALSE(proper.reflected);
  EXPECT_GT(rms(transformed(proper, from), to), 0.1);
  const Alignment3 mirrored = align_in_space(from, to, {.allow_reflection = true});
  EXPECT_TRUE(mirrored.reflected);
  EXPECT_LT(rms(transformed(mirrored, from), to), 1e-9);
  // A mirrored pose keeps its axes x and z and reverses y.
  const Pose3 pose{{0.5, -1.0, 2.0}, random_rotation(random)};
  const Pose3 seen = mirrored.apply(pose);
  for (const auto& [axis, sign] : {std::pair{Point3{1, 0, 0}, 1.0}, {Point3{0, 1, 0}, -1.0}}) {
    const Point3 tip = pose.rotation * axis;
    const Point3 end = mirrored.apply(Point3{
        pose.position.x_m + tip.x_m, pose.position.y_m + tip.y_m, pose.position.z_m + tip.z_m});
    const Point3 turned = seen.rotation * axis;
    EXPECT_NEAR(end.x_m - seen.position.x_m, sign * turned.x_m, 1e-9);
    EXPECT_NEAR(end.z_m - seen.position.z_m, sign * turned.z_m, 1e-9);
  }
}

TEST(Alignment3, PointsOnALineGetTheSmallestRotation) {
  Random random(14);
  for (int round = 0; round < 20; ++round) {
    const Rotation3 q = random_rotation(random);
    Points3 from;
    for (int i = 0; i < 7; ++i) from.push_back({0.3 * i, 0.2 * i, -0.7 * i});
    const Alignment3 map{1.0, q, {5, 6, -7}, false, true};
    const Points3 to = transformed(map, from);
    const Alignment3 found = align_in_space(from, to);
    EXPECT_FALSE(found.is_unique);
    EXPECT_LT(rms(transformed(found, from), to), 1e-9);
    EXPECT_LE(found.rotation.angle_rad(), q.angle_rad() + 1e-9);
  }
  const Points3 still(4, Point3{1, 2, 3});
  const Alignment3 moved_only = align_in_space(still, Points3(4, Point3{4, 4, 4}), {true, true});
  EXPECT_EQ(moved_only.rotation, Rotation3{});
  EXPECT_EQ(moved_only.scale, 1.0);
  EXPECT_EQ(moved_only.apply(Point3{1, 2, 3}), (Point3{4, 4, 4}));
  EXPECT_THROW((void)align_in_space(Points3{}, Points3{}), ContractError);
  EXPECT_THROW((void)align_in_plane(still, Points3(3)), ContractError);
}

TEST(Alignment3, InThePlaneNothingIsTurnedOver) {
  Random random(15);
  Points3 from;
  for (const Point2& p : random_points(random, 9)) from.push_back({p.x_m, p.y_m, 0.4});
  const Alignment3 map{2.0, Rotation3::from_yaw(0.8), {1, 2, 3}, false, true};
  const Alignment3 same = align_in_plane(from, transformed(map, from), {.allow_scale = true});
  EXPECT_LT(rms(transformed(same, from), transformed(map, from)), 1e-9);
  Points3 mirrored = from;
  for (Point3& p : mirrored) p.y_m = -p.y_m;
  EXPECT_LT(rms(transformed(align_in_space(mirrored, from), mirrored), from), 1e-9);
  EXPECT_GT(rms(transformed(align_in_plane(mirrored, from), mirrored), from), 0.1);
}

}  // namespace
}  // namespace panonav
