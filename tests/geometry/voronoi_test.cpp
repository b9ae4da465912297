#include "panonav/geometry/voronoi.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

using Points = std::vector<Point2>;

Points grid(int columns, int rows, double step_m, double turn_rad, Point2 origin) {
  Points points;
  const Pose2 world_from_grid{origin.x_m, origin.y_m, turn_rad};
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j)
      points.push_back(world_from_grid * Point2{i * step_m, j * step_m});
  }
  return points;
}

bool inside(const Points& polygon, Point2 p) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 a = polygon[i];
    const Point2 b = polygon[(i + 1) % polygon.size()];
    if ((b.x_m - a.x_m) * (p.y_m - a.y_m) - (b.y_m - a.y_m) * (p.x_m - a.x_m) < 0.0) return false;
  }
  return polygon.size() >= 3;
}

TEST(PolygonArea, OfTrianglesAndSquares) {
  EXPECT_DOUBLE_EQ(polygon_area_m2(Points{{0, 0}, {2, 0}, {0, 3}}), 3.0);
  EXPECT_DOUBLE_EQ(polygon_area_m2(Points{{0, 0}, {0, 3}, {2, 0}}), -3.0);
  EXPECT_DOUBLE_EQ(
      polygon_area_m2(Points{{1e6, 1e6}, {1e6 + 1, 1e6}, {1e6 + 1, 1e6 + 1}, {1e6, 1e6 + 1}}), 1.0);
  EXPECT_EQ(polygon_area_m2(Points{{0, 0}, {2, 0}}), 0.0);
}

TEST(VoronoiCells, EveryCellOfASquareGridHasTheAreaOfTheGridStep) {
  for (const double turn : {0.0, 0.3, 0.785398, 2.0}) {
    for (const auto& [columns, rows] : {std::pair(2, 2), std::pair(5, 4), std::pair(9, 2)}) {
      const Points points = grid(columns, rows, 0.25, turn, {3.0, -8.0});
      const VoronoiCells cells(points);
      EXPECT_NEAR(cells.spacing_m(), 0.25, 1e-12);
      ASSERT_EQ(cells.sites().size(), points.size());
      for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(cells.area_m2(i), 0.0625, 1e-9);
    }
  }
}

TEST(VoronoiCells, OfALineAreStripsAsWideAsTheSpacing) {
  for (const double turn : {0.0, 0.4, 1.5707963267948966}) {
    const VoronoiCells cells(grid(7, 1, 0.5, turn, {1.0, 1.0}));
    EXPECT_NEAR(cells.spacing_m(), 0.5, 1e-12);
    for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(cells.area_m2(i), 0.25, 1e-12);
  }
}

TEST(VoronoiCells, HoldTheirSiteDoNotOverlapAndAnswerWhoIsNearest) {
  Random random(41);
  Points points(120);
  for (auto& p : points) p = {random.uniform(0, 4), random.uniform(0, 3)};
  const VoronoiCells cells(points);
  std::vector<Points> polygons;
  for (std::size_t i = 0; i < points.size(); ++i) {
    polygons.push_back(cells.cell(i));
    EXPECT_TRUE(inside(polygons.back(), points[i]));
    EXPECT_GT(cells.area_m2(i), 0.0);
    EXPECT_LE(cells.area_m2(i), cells.spacing_m() * cells.spacing_m() * (1 + 1e-12));
  }
  int covered = 0;
  double sampled = 0.0;
  constexpr int samples = 20'000;
  for (int s = 0; s < samples; ++s) {
    const Point2 p{random.uniform(-1, 5), random.uniform(-1, 4)};
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (distance(p, points[i]) < distance(p, points[nearest])) nearest = i;
    }
    int holders = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!inside(polygons[i], p)) continue;
      ++holders;
      EXPECT_EQ(i, nearest);
    }
    EXPECT_LE(holders, 1);
    covered += holders;
  }
  // The sum of the areas against the covered share of the 6 x 5 m box, within 5 standard errors.
  double total = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) total += cells.area_m2(i);
  sampled = 30.0 * covered / samples;
  EXPECT_GT(covered, 1000);
  EXPECT_NEAR(total, sampled, 5.0 * 30.0 * std::sqrt(0.25 / samples));
}

TEST(VoronoiCells, CoincidentPositionsShareASite) {
  const Points points = {{0, 0}, {1, 0}, {0, 0}, {2, 0}, {1, 0}, {3, 0}};
  const VoronoiCells cells(points);
  ASSERT_EQ(cells.sites().size(), 4U);
  EXPECT_EQ(std::vector<std::size_t>(cells.site_of().begin(), cells.site_of().end()),
            (std::vector<std::size_t>{0, 1, 0, 2, 1, 3}));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(cells.area_m2(i), 1.0, 1e-12);
}

TEST(VoronoiCells, OfOneTwoAndNoPositions) {
  const VoronoiCells none(Points{});
  EXPECT_TRUE(none.sites().empty());
  const VoronoiCells one(Points{{2, 3}});
  EXPECT_EQ(one.spacing_m(), 0.0);
  EXPECT_EQ(one.area_m2(0), 0.0);
  EXPECT_NEAR(VoronoiCells(Points{{2, 3}}, 0.5).area_m2(0), 0.25, 1e-12);
  const VoronoiCells two(Points{{0, 0}, {3, 4}});
  EXPECT_NEAR(two.spacing_m(), 5.0, 1e-12);
  EXPECT_NEAR(two.area_m2(0), 25.0, 1e-9);
  EXPECT_NEAR(two.area_m2(1), 25.0, 1e-9);
}

TEST(VoronoiCells, SpacingIsThatOfBruteForce) {
  Random random(42);
  for (int trial = 0; trial < 20; ++trial) {
    Points points(3 + random.index(60));
    for (auto& p : points) p = {random.uniform(0, 1), random.uniform(0, 5)};
    std::vector<double> second;
    for (const Point2 p : points) {
      std::vector<double> d;
      for (const Point2 q : points) d.push_back(distance(p, q));
      std::sort(d.begin(), d.end());
      second.push_back(d[2]);
    }
    std::sort(second.begin(), second.end());
    EXPECT_DOUBLE_EQ(VoronoiCells(points).spacing_m(), second[(second.size() - 1) / 2]);
  }
}

TEST(VoronoiCells, RefusesWhatIsNotFinite) {
  EXPECT_THROW(VoronoiCells(Points{{0, std::nan("")}}), ContractError);
  EXPECT_THROW(VoronoiCells(Points{{std::numeric_limits<double>::infinity(), 0}}), ContractError);
  EXPECT_THROW(VoronoiCells(Points{{0, 0}}, 0.0), ContractError);
  EXPECT_THROW((void)VoronoiCells(Points{{0, 0}}).cell(1), ContractError);
}

TEST(SmallestEnclosingCircle, IsThatOfBruteForce) {
  Random random(43);
  for (int trial = 0; trial < 200; ++trial) {
    Points points(1 + random.index(9));
    for (auto& p : points) p = {random.uniform(0, 1), trial % 5 == 0 ? 0.5 : random.uniform(0, 1)};
    const Circle circle = smallest_enclosing_circle(points);
    for (const Point2 p : points) EXPECT_LE(distance(p, circle.centre), circle.radius_m + 1e-9);
    // No circle about a point of a fine mesh covers all with a clearly smaller radius.
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; j <= 40; ++j) {
        double needed = 0.0;
        for (const Point2 p : points) needed = std::max(needed, distance(p, {i / 40.0, j / 40.0}));
        EXPECT_GE(needed, circle.radius_m - 1e-9);
      }
    }
  }
  EXPECT_EQ(smallest_enclosing_circle({}).radius_m, 0.0);
}

TEST(SmallestEnclosingCircle, NeverGrowsWhenPointsAreTakenAway) {
  Random random(44);
  Points points(40);
  for (auto& p : points) p = {random.normal(), random.normal()};
  double radius = std::numeric_limits<double>::infinity();
  while (!points.empty()) {
    const double now = smallest_enclosing_circle(points).radius_m;
    EXPECT_LE(now, radius + 1e-12);
    radius = now;
    points.pop_back();
  }
}

}  // namespace
}  // namespace panonav
