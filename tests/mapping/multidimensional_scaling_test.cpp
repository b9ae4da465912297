#include "panonav/mapping/internal/multidimensional_scaling.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"

namespace panonav {
namespace {

std::vector<Point2> random_points_in_room(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Point2> points(count);
  for (Point2& point : points) point = {random.uniform(0.0, 5.0), random.uniform(0.0, 3.0)};
  return points;
}

std::vector<double> distances_between(const std::vector<Point2>& points,
                                      const std::vector<std::size_t>& landmarks) {
  std::vector<double> result;
  for (const std::size_t i : landmarks) {
    for (const Point2& point : points) result.push_back(distance(points[i], point));
  }
  return result;
}

TEST(MultidimensionalScaling, TrueDistancesGiveTheTrueShape) {
  const auto points = random_points_in_room(40, 1);
  std::vector<std::size_t> all(points.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const auto& landmarks : {all, std::vector<std::size_t>{3, 17, 20, 31}}) {
    const auto found =
        multidimensional_scaling(landmarks, points.size(), distances_between(points, landmarks));
    ASSERT_EQ(found.size(), points.size());
    EXPECT_LT(align(found, points, {.allow_reflection = true}).rms_m, 1e-9);
    EXPECT_EQ(found, multidimensional_scaling(landmarks, points.size(),
                                              distances_between(points, landmarks)));
  }
}

TEST(MultidimensionalScaling, PointsOnALineStayOnIt) {
  std::vector<Point2> points;
  for (int i = 0; i < 6; ++i) points.push_back({0.3 * i, 0.0});
  const std::vector<std::size_t> landmarks{0, 1, 2, 3, 4, 5};
  const auto found = multidimensional_scaling(landmarks, 6, distances_between(points, landmarks));
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(distance(found[i], found[i + 1]), 0.3, 1e-6);
    EXPECT_NEAR(found[i].y_m, 0.0, 1e-5);
  }
}

TEST(MultidimensionalScaling, WithoutExtentAllCoincide) {
  const std::vector<std::size_t> landmarks{0, 1};
  const std::vector<double> none(6, 0.0);
  for (const Point2& point : multidimensional_scaling(landmarks, 3, none)) {
    EXPECT_EQ(point, Point2{});
  }
  const std::vector<std::size_t> one{0};
  EXPECT_EQ(multidimensional_scaling(one, 1, std::vector<double>{0.0}),
            std::vector<Point2>{Point2{}});
}

TEST(MultidimensionalScaling, RefusesWhatIsNoDistance) {
  const std::vector<std::size_t> one{0};
  EXPECT_THROW((void)multidimensional_scaling(one, 2, std::vector<double>{0.0, -1.0}),
               ContractError);
  EXPECT_THROW((void)multidimensional_scaling(one, 2, std::vector<double>{0.0, std::nan("")}),
               ContractError);
  EXPECT_THROW((void)multidimensional_scaling(one, 2, std::vector<double>{0.0}), ContractError);
  EXPECT_THROW((void)multidimensional_scaling({}, 1, {}), ContractError);
}

}  // namespace
}  // namespace panonav
