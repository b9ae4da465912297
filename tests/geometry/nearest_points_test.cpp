#include "panonav/geometry/nearest_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(NearestPoints, AreThoseOfAFullScan) {
  Random random(3);
  std::vector<Point2> points;
  std::vector<std::size_t> group;
  for (int i = 0; i < 200; ++i) {
    points.push_back({random.uniform(0.0, 3.0), random.uniform(0.0, 2.0)});
    group.push_back(random.index(3));
  }
  points.push_back(points.front());  // one twice
  group.push_back(group.front());
  const auto found = nearest_points(points, group, 5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<std::pair<double, std::size_t>> all;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (j != i && group[j] == group[i]) all.emplace_back(distance(points[i], points[j]), j);
    }
    std::ranges::sort(all);
    ASSERT_EQ(found[i].size(), 5U);
    for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(found[i][k], all[k].second);
  }
}

TEST(NearestPoints, CopiesOfAPositionCountOnce) {
  // Copies differ by rounding, also across a border of cells of the comparison (at 0).
  const std::vector<Point2> points{{0.0, 0.0}, {-1e-17, 1e-17}, {1e-17, 0.0},
                                   {3.0, 4.0}, {3.0, 4.0},      {3.0, 10.0},
                                   {0.0, 1.0}, {3.0, 5.0},      {3.0 + 1e-12, 4.0}};
  const std::vector<std::size_t> groups{0, 0, 0, 0, 0, 0, 1, 2, 0};
  std::vector<double> distances = distances_between_nearest_positions(points, groups);
  std::ranges::sort(distances);
  ASSERT_EQ(distances.size(), 3U);
  EXPECT_NEAR(distances[0], 5.0, 1e-9);
  EXPECT_NEAR(distances[1], 5.0, 1e-9);
  EXPECT_NEAR(distances[2], 6.0, 1e-9);
  EXPECT_TRUE(distances_between_nearest_positions({}, {}).empty());
  const std::vector<Point2> origin(5);
  EXPECT_TRUE(distances_between_nearest_positions(origin, std::vector<std::size_t>(5, 0)).empty());
}

}  // namespace
}  // namespace panonav
