#include "panonav/navigation/known_route.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/navigation/internal/route_pilot.hpp"
#include "support/smooth_path.hpp"

namespace panonav::testing {
namespace {

// The lines do not matter here.
constexpr KnownRouteOptions unlearnt{.tracker = {.min_correlation = 0.5}};

RoutePanorama blank_route(const std::vector<Pose2>& path) {
  RoutePanorama route(16);
  for (const Pose2& pose : path) route.append(pose, std::vector<float>(16, 0.5F));
  return route;
}

std::vector<Pose2> curve() {
  return smooth_path(std::vector<Point2>{{-3, -0.8}, {-1.2, 0.5}, {0.6, -0.3}, {2.8, 0.6}}, 0.1);
}

ViewId id(std::size_t value) {
  return ViewId{static_cast<std::uint32_t>(value)};
}

// Every third pose of a path, beside it by `lateral_m`; ids descend.
std::vector<KnownRoute::View> views_beside(const std::vector<Pose2>& path, double lateral_m) {
  std::vector<KnownRoute::View> views;
  for (std::size_t i = 0; i < path.size(); i += 3) {
    views.push_back({id(path.size() - i), path[i] * Pose2{0.0, lateral_m, 1.0}});
  }
  return views;
}

TEST(KnownRoute, KnowsWhereItsViewsLie) {
  const auto path = curve();
  for (const double lateral_m : {0.0, 0.1, -0.1}) {
    const auto views = views_beside(path, lateral_m);
    const KnownRoute known = make_known_route(blank_route(path), views, unlearnt);
    ASSERT_EQ(known.references.size(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto along_m = known.along_m(views[i].view);
      ASSERT_EQ(along_m.size(), 1U);
      // Between straight parts and the tangents of the curve there is a little room.
      EXPECT_NEAR(along_m[0], path_length_m(std::span(path).first(3 * i + 1)),
                  lateral_m == 0.0 ? 1e-9 : 0.02);
    }
    EXPECT_TRUE(known.along_m(id(999)).empty());
  }
  const auto beyond = views_beside(path, 0.5);
  EXPECT_TRUE(make_known_route(blank_route(path), beyond, unlearnt).references.empty());
}

// A way over views of the route in their order is the route between them, and back.
TEST(KnownRoute, AWayOverItsViewsGoesAlongIt) {
  const auto path = curve();
  const auto views = views_beside(path, 0.0);
  const KnownRoute known = make_known_route(blank_route(path), views, unlearnt);
  const std::vector<Pose2> reversed(path.rbegin(), path.rend());
  const KnownRoute back = make_known_route(blank_route(reversed), views, unlearnt);
  const double length_m = path_length_m(path);
  Random random(3);
  for (int trial = 0; trial < 30; ++trial) {
    const std::size_t a = random.index(views.size());
    const std::size_t b = random.index(views.size());
    std::vector<ViewId> way;
    // Views elsewhere do not matter.
    for (std::size_t i = a;; i = a < b ? i + 1 : i - 1) {
      way.push_back(views[i].view);
      way.push_back(id(1000 + i));
      if (i == b) break;
    }
    const auto stretch = find_section(known, known.along_m(views[a].view), way);
    ASSERT_TRUE(stretch.has_value());
    EXPECT_EQ(stretch->from_m, known.along_m(views[a].view)[0]);
    EXPECT_EQ(stretch->to_m, known.along_m(views[b].view)[0]);
    EXPECT_EQ(way[stretch->last], views[b].view);
    const auto other = find_section(back, back.along_m(views[a].view), way);
    ASSERT_TRUE(other.has_value());
    EXPECT_NEAR(other->from_m, length_m - stretch->from_m, 1e-9);
    EXPECT_NEAR(other->to_m, length_m - stretch->to_m, 1e-9);
  }
}

// Along a side of a hairpin, then straight over to the other one, where the route goes round.
TEST(KnownRoute, EndsWhereTheWayGoesAcross) {
  std::vector<Pose2> path;
  for (const Point2 corner : {Point2{0, 0}, Point2{5, 0}, Point2{5, 2}, Point2{0, 2}}) {
    path.push_back({corner.x_m, corner.y_m, 0.0});
  }
  const std::vector<KnownRoute::View> views{{id(0), {1, 0, 0}}, {id(1), {2, 0, 0}},
                                            {id(2), {3, 0, 0}}, {id(3), {3, 2, 0}},
                                            {id(4), {2, 2, 0}}, {id(5), {5, 1, 0}}};
  const KnownRoute known = make_known_route(blank_route(path), views, unlearnt);
  const std::vector<ViewId> across{id(0), id(1), id(2), id(3), id(4)};
  const auto stretch = find_section(known, known.along_m(id(0)), across);
  ASSERT_TRUE(stretch.has_value());
  EXPECT_EQ(stretch->last, 2U);
  EXPECT_DOUBLE_EQ(stretch->length_m(), 2.0);
  // Round the corners it is the route.
  const std::vector<ViewId> round{id(0), id(1), id(2), id(5), id(3), id(4)};
  const auto whole = find_section(known, known.along_m(id(0)), round);
  ASSERT_TRUE(whole.has_value());
  EXPECT_EQ(whole->last, 5U);
  EXPECT_DOUBLE_EQ(whole->to_m, 10.0);
}

// Several rounds: the one that needs no other is followed, in the direction of the path.
TEST(KnownRoute, GoesAlongTheRoundThatIsNearest) {
  std::vector<Pose2> path;
  std::vector<KnownRoute::View> views;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 24; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 24.0;
      path.push_back({3.0 * std::cos(angle), 3.0 * std::sin(angle), 0.0});
      if (round == 0) views.push_back({id(static_cast<std::size_t>(i)), path.back()});
    }
  }
  const KnownRoute known = make_known_route(blank_route(path), views, unlearnt);
  ASSERT_EQ(known.along_m(id(5)).size(), 3U);
  const double part_m = distance(path[0].position(), path[1].position());
  for (const int step : {1, -1}) {
    std::vector<ViewId> way;
    for (int i = 0; i < 7; ++i) way.push_back(id(static_cast<std::size_t>((22 + step * i) % 24)));
    const auto stretch = find_section(known, known.along_m(way[0]), way);
    ASSERT_TRUE(stretch.has_value());
    EXPECT_EQ(stretch->last, 6U);
    EXPECT_NEAR(stretch->to_m - stretch->from_m, step * 6 * part_m, 1e-9);
  }
}

TEST(KnownRoute, RefusesWhatMakesNoSense) {
  const auto path = curve();
  const RoutePanorama route = blank_route(path);
  const std::vector<KnownRoute::View> twice{{id(1), path[0]}, {id(1), path[1]}};
  EXPECT_THROW((void)make_known_route(route, twice, unlearnt), ContractError);
  const std::vector<KnownRoute::View> nowhere{
      {id(1), {std::numeric_limits<double>::quiet_NaN(), 0, 0}}};
  EXPECT_THROW((void)make_known_route(route, nowhere, unlearnt), ContractError);
  EXPECT_THROW((void)make_known_route(blank_route({{0, 0, 0}}), {}, unlearnt), ContractError);
  EXPECT_THROW((void)make_known_route(route, {}, {.max_lateral_m = 0.0}), OptionError);
  EXPECT_FALSE(find_section(make_known_route(route, {}, unlearnt), std::vector<double>{0.0},
                            std::vector<ViewId>{id(1)}));
}

}  // namespace
}  // namespace panonav::testing
