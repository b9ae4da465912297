#include "panonav/mapping/map_measures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

std::vector<Point2> random_points(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Point2> points(count);
  for (Point2& p : points) p = {random.uniform(0.0, 5.0), random.uniform(0.0, 5.0)};
  return points;
}

TEST(IsComparable, NeedsThreePointsAndAnExtentInBoth) {
  const std::vector<Point2> line{{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}};
  const std::vector<Point2> place(3, Point2{1.0, 1.0});
  EXPECT_TRUE(is_comparable(line, line));
  EXPECT_FALSE(is_comparable(line, place));
  EXPECT_FALSE(is_comparable(place, line));
  EXPECT_FALSE(is_comparable(line, std::span(line).first(2)));
  EXPECT_FALSE(is_comparable(std::span(line).first(2), std::span(line).first(2)));
  EXPECT_FALSE(is_comparable({}, {}));
}

TEST(NeighbourPreservation, ACopyTurnedAndScaledKeepsAll) {
  const auto truth = random_points(60, 1);
  std::vector<Point2> map;
  for (const Point2& p : truth) map.push_back({-3.0 * p.y_m + 7.0, 3.0 * p.x_m});
  const auto kept = neighbour_preservation(map, truth, 8);
  EXPECT_DOUBLE_EQ(kept.trustworthiness, 1.0);
  EXPECT_DOUBLE_EQ(kept.continuity, 1.0);
}

TEST(NeighbourPreservation, ChanceIsAboutAHalf) {
  const auto kept = neighbour_preservation(random_points(200, 2), random_points(200, 3), 10);
  EXPECT_NEAR(kept.trustworthiness, 0.5, 0.05);
  EXPECT_NEAR(kept.continuity, 0.5, 0.05);
}

TEST(NeighbourPreservation, SwappingTheSetsSwapsTheMeasures) {
  const auto truth = random_points(50, 4);
  auto folded = truth;  // two halves on top of each other: new neighbours come, old ones stay
  for (Point2& p : folded) p.x_m = std::min(p.x_m, 5.0 - p.x_m);
  const auto there = neighbour_preservation(folded, truth, 5);
  const auto back = neighbour_preservation(truth, folded, 5);
  EXPECT_LT(there.trustworthiness, 0.98);
  EXPECT_DOUBLE_EQ(there.trustworthiness, back.continuity);
  EXPECT_DOUBLE_EQ(there.continuity, back.trustworthiness);
  EXPECT_LT(there.trustworthiness, there.continuity);
}

TEST(NeighbourPreservation, RefusesWhatHasNoMeaning) {
  const auto points = random_points(10, 5);
  EXPECT_THROW((void)neighbour_preservation(points, random_points(9, 5), 2), ContractError);
  EXPECT_THROW((void)neighbour_preservation(points, points, 0), ContractError);
  EXPECT_THROW((void)neighbour_preservation(points, points, 7), ContractError);
  EXPECT_THROW((void)neighbour_preservation({}, {}, 1), ContractError);
  auto broken = points;
  broken[3].x_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)neighbour_preservation(broken, points, 2), ContractError);
}

TEST(ComparePositions, AgreesWithItsPartsAndThinsLargeMaps) {
  const auto truth = random_points(40, 6);
  std::vector<Point2> map;
  for (const Point2& p : truth) map.push_back({-0.5 * p.y_m + 7.0, 0.5 * p.x_m});
  const auto copy = compare_positions(map, truth);
  ASSERT_TRUE(copy.has_value());
  EXPECT_EQ(copy->compared, 40U);
  EXPECT_NEAR(copy->shape.value, 0.0, 1e-12);
  EXPECT_NEAR(copy->truth_from_map.scale, 2.0, 1e-9);
  EXPECT_NEAR(copy->truth_from_map.rms_m, 0.0, 1e-9);
  EXPECT_EQ(copy->neighbours.value().continuity, 1.0);
  EXPECT_EQ(compare_positions(map, truth, false)->truth_from_map.scale, 1.0);
  EXPECT_FALSE(compare_positions(std::span(map).first(2), std::span(truth).first(2)));
  const auto few = compare_positions(std::span(map).first(12), std::span(truth).first(12));
  EXPECT_FALSE(few.value().neighbours.has_value());
  const auto many = random_points(5000, 7);
  const auto others = random_points(5000, 8);
  std::vector<Point2> every_third;
  std::vector<Point2> every_third_of_others;
  for (std::size_t i = 0; i < many.size(); i += 3) {
    every_third.push_back(many[i]);
    every_third_of_others.push_back(others[i]);
  }
  EXPECT_EQ(compare_positions(many, others)->neighbours.value().trustworthiness,
            neighbour_preservation(every_third, every_third_of_others, 8).trustworthiness);
}

TEST(Closures, AreCountedByTheDistanceOfTheViews) {
  TopologicalMap map;
  for (unsigned i = 0; i < 4; ++i) map.nodes.push_back({ViewId{i}, {}, 0});
  map.edges = {{ViewId{0}, ViewId{1}, {}, Link::Kind::sequence},
               {ViewId{0}, ViewId{2}, {}, Link::Kind::closure},
               {ViewId{1}, ViewId{2}, {}, Link::Kind::closure},
               {ViewId{0}, ViewId{3}, {}, Link::Kind::closure}};
  const auto count = count_closures(
      map,
      [](ViewId view) -> std::optional<Point2> {
        if (view.value == 3) return std::nullopt;
        return Point2{static_cast<double>(view.value), 0.0};
      },
      1.5);
  EXPECT_EQ(count.right, 1U);
  EXPECT_EQ(count.wrong, 1U);
  EXPECT_EQ(count.unknown, 1U);
}

}  // namespace
}  // namespace panonav
