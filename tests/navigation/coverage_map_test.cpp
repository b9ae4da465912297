#include "panonav/navigation/coverage_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

// Observations of a room of 2 x 2 m around (0, 0) from its middle: walls all around, and ranges in
// all directions.
FloorObservations make_room() {
  FloorObservations floor;
  floor.driven.push_back({{0.0, 0.0}, {0.0, 0.0}});
  for (double along_m = -1.0; along_m <= 1.0; along_m += 0.05) {
    for (const Point2 wall : {Point2{along_m, -1.0}, Point2{along_m, 1.0}, Point2{-1.0, along_m},
                              Point2{1.0, along_m}}) {
      floor.obstacles.push_back(wall);
      floor.open.push_back({{0.0, 0.0}, {0.9 * wall.x_m, 0.9 * wall.y_m}});
    }
  }
  return floor;
}

const std::vector<Point2> corners{{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};

TEST(CoverageMap, FloorThatAViewCoversIsNoFrontier) {
  FloorObservations floor = make_room();
  const CoverageMap before(floor, {});
  std::size_t frontier = 0;
  for (double x_m = -0.7; x_m <= 0.7; x_m += 0.1) {
    frontier += before.is_frontier({x_m, 0.3}) ? 1U : 0U;
    EXPECT_FALSE(before.is_covered({x_m, 0.3}));
  }
  EXPECT_GE(frontier, 12U);
  EXPECT_GT(before.compute_gain_m2({0.0, 0.0}), 0.5);
  floor.views.push_back({{0.0, 0.0}, 0.5});
  const CoverageMap after(floor, {});
  EXPECT_EQ(after.compute_gain_m2({0.0, 0.0}), 0.0);
  for (double x_m = -0.3; x_m <= 0.3; x_m += 0.1) {
    EXPECT_TRUE(after.is_covered({x_m, 0.3}));
    EXPECT_FALSE(after.is_frontier({x_m, 0.3}));
  }
  EXPECT_TRUE(after.is_frontier({0.65, 0.65}));
}

TEST(CoverageMap, NothingRemainsInAClosedRoomWithEverythingCovered) {
  FloorObservations floor = make_room();
  int views = 0;
  for (; views < 20; ++views) {
    const auto next = CoverageMap(floor, {}).find_view_point({0.0, 0.0});
    if (!next) break;
    EXPECT_GE(next->area_m2, CoverageOptions{}.min_area_m2);
    // In the room, as far from its walls as the robot is wide.
    EXPECT_LE(std::max(std::abs(next->position.x_m), std::abs(next->position.y_m)), 0.85);
    floor.views.push_back({next->position, 0.5});
  }
  EXPECT_GE(views, 3);
  EXPECT_LE(views, 12);
  const CoverageMap covered(floor, {});
  for (const Point2& corner : corners) EXPECT_TRUE(covered.is_covered(corner));
}

// A corridor of known, covered floor from (0, 0) to (20, 0), and behind its end an uncovered floor
// this wide and deep.
FloorObservations make_corridor_to_floor(double side_m) {
  FloorObservations floor;
  floor.driven.push_back({{0.0, 0.0}, {20.0, 0.0}});
  for (double x_m = 0.0; x_m <= 20.0; x_m += 0.25) floor.views.push_back({{x_m, 0.0}, 0.5});
  for (double y_m = -0.5 * side_m; y_m <= 0.5 * side_m; y_m += 0.1) {
    floor.open.push_back({{20.6, y_m}, {20.6 + side_m, y_m}});
  }
  return floor;
}

TEST(CoverageMap, AnotherRoomIsWorthAPathThatARemnantIsNotWorth) {
  // One view covers less than a square metre of either.
  const auto room = CoverageMap(make_corridor_to_floor(3.0), {}).find_view_point({0.0, 0.0});
  ASSERT_TRUE(room);
  EXPECT_GT(room->position.x_m, 20.0);
  EXPECT_LT(room->area_m2, 1.0);
  const CoverageMap remnant(make_corridor_to_floor(0.5), {});
  EXPECT_FALSE(remnant.find_view_point({0.0, 0.0}));
  EXPECT_TRUE(remnant.find_view_point({19.0, 0.0}));
}

TEST(CoverageMap, ARoomOfWhichLittleIsExpectedToBeFloorIsNotWorthALongPath) {
  const CoverageMap map(make_corridor_to_floor(3.0), {});
  EXPECT_TRUE(map.find_view_point({0.0, 0.0}, 0.5));
  EXPECT_FALSE(map.find_view_point({0.0, 0.0}, 0.05));
  EXPECT_TRUE(map.find_view_point({20.0, 0.0}, 0.05));
}

TEST(CoverageMap, AViewDoesNotCoverWhatIsBehindAnObstacle) {
  FloorObservations floor;
  floor.driven.push_back({{0.0, 0.0}, {0.0, 0.0}});
  floor.open.push_back({{0.0, 0.0}, {2.0, 0.0}});
  floor.views.push_back({{0.0, 0.0}, 1.0});
  EXPECT_TRUE(CoverageMap(floor, {}).is_covered({0.8, 0.0}));
  floor.obstacles.push_back({0.4, 0.0});
  const CoverageMap map(floor, {});
  EXPECT_TRUE(map.is_covered({0.1, 0.0}));
  EXPECT_TRUE(map.is_blocked({0.4, 0.0}));
  EXPECT_FALSE(map.is_covered({0.8, 0.0}));
  EXPECT_FALSE(map.is_open_between({0.0, 0.0}, {0.8, 0.0}));
}

TEST(CoverageMap, PathsLeadAroundObstaclesAndBlockedPositionsAreNotTriedAgain) {
  FloorObservations floor = make_room();
  floor.obstacles.push_back({0.0, 0.0});
  floor.driven = {{{-0.6, 0.0}, {-0.6, 0.0}}};
  const CoverageMap map(floor, {});
  const auto path = map.find_path({-0.6, 0.0}, {0.6, 0.0});
  ASSERT_TRUE(path);
  ASSERT_FALSE(path->empty());
  for (const Point2& point : *path) EXPECT_GT(std::hypot(point.x_m, point.y_m), 0.19);
  EXPECT_LE(distance(path->back(), {0.6, 0.0}), 0.1);
  // The robot could not pass where it was led.
  const Point2 contact = path->at(path->size() / 2);
  floor.impassable.push_back(contact);
  const CoverageMap next(floor, {});
  EXPECT_TRUE(next.is_blocked(contact));
  const auto other = next.find_path({-0.6, 0.0}, {0.6, 0.0});
  ASSERT_TRUE(other);
  for (const Point2& point : *other) EXPECT_FALSE(next.is_blocked(point));
  // No path leads out of the room.
  EXPECT_FALSE(map.find_path({-0.6, 0.0}, {1.6, 0.0}));
}

TEST(CoverageMap, APositionThatIsGivenUpIsNoFrontier) {
  FloorObservations floor = make_room();
  const auto first = CoverageMap(floor, {}).find_view_point({0.0, 0.0});
  ASSERT_TRUE(first);
  floor.given_up.push_back(first->position);
  const CoverageMap map(floor, {});
  EXPECT_FALSE(map.is_frontier(first->position));
  const auto second = map.find_view_point({0.0, 0.0});
  ASSERT_TRUE(second);
  EXPECT_NE(second->position, first->position);
}

TEST(CoverageMap, WithoutRangesTheFloorAroundTheRobotIsAssumedToBeFree) {
  FloorObservations floor;
  floor.driven.push_back({{0.0, 0.0}, {0.0, 0.0}});
  EXPECT_FALSE(CoverageMap(floor, {}).is_frontier({0.6, 0.0}));
  EXPECT_TRUE(CoverageMap(floor, {.assumed_open_m = 0.75}).is_frontier({0.6, 0.0}));
  floor.obstacles.push_back({0.35, 0.0});
  EXPECT_FALSE(CoverageMap(floor, {.assumed_open_m = 0.75}).is_frontier({0.6, 0.0}));
}

TEST(CoverageMap, RejectsOptionsOutOfRange) {
  for (const CoverageOptions& options :
       {CoverageOptions{.radius_m = 0.0}, CoverageOptions{.robot_radius_m = -0.1},
        CoverageOptions{.cell_m = 0.0}, CoverageOptions{.min_area_m2 = 0.0}}) {
    EXPECT_THROW(CoverageMap({}, options), ContractError);
  }
}

}  // namespace
}  // namespace panonav
