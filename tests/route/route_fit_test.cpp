#include "panonav/route/route_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/smooth_path.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

std::vector<Pose2> straight_path(double length_m, double spacing_m) {
  std::vector<Pose2> path;
  const int steps = static_cast<int>(std::lround(length_m / spacing_m));
  for (int i = 0; i <= steps; ++i) path.push_back({i * spacing_m - length_m / 2.0, 0.0, 0.0});
  return path;
}

RoutePanorama record(const ToyWorld& room, const std::vector<Pose2>& path) {
  RoutePanorama route;
  for (const Pose2& pose : path) route.append(pose, room.line(pose));
  return route;
}

// Every direction against every stretch of the path.
TEST(RouteCrossing, IsTheNearestOfAllStretches) {
  Random random(3);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Point2> way_points;
    for (int i = 0; i < 5; ++i) {
      way_points.push_back({random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)});
    }
    const auto path = smooth_path(way_points, 0.13);
    const Point2 viewpoint{random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0)};
    const auto directions = equal_directions(90);
    std::vector<RouteCrossing> crossings(90);
    find_crossings(path, 7, viewpoint, directions, crossings);
    for (std::size_t c = 0; c < directions.size(); ++c) {
      double nearest = std::numeric_limits<double>::infinity();
      double along = -1.0;
      for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        const double ex = path[i + 1].x_m - path[i].x_m;
        const double ey = path[i + 1].y_m - path[i].y_m;
        const double ax = path[i].x_m - viewpoint.x_m;
        const double ay = path[i].y_m - viewpoint.y_m;
        const double across = ex * directions[c].y - ey * directions[c].x;
        const double share = (ay * directions[c].x - ax * directions[c].y) / across;
        if (!(share >= 0.0 && share <= 1.0)) continue;
        const double far =
            (ax + share * ex) * directions[c].x + (ay + share * ey) * directions[c].y;
        if (std::abs(far) < nearest) {
          nearest = std::abs(far);
          along = 7.0 + static_cast<double>(i) + share;
        }
      }
      if (along < 0.0) {
        EXPECT_LT(crossings[c].along, 0.0F);
      } else {
        EXPECT_NEAR(std::abs(crossings[c].distance_m), nearest, 1e-4);
        EXPECT_NEAR(crossings[c].along, along, 1e-3);
      }
    }
  }
}

// The index finds what a scan of all segments of the window finds, on paths of any shape: straight
// along an axis, back and forth, with jumps, with a viewpoint on the path.
TEST(PathIndex, FindsTheCrossingsAndWindowsOfAScan) {
  Random random(12);
  std::size_t crossed = 0;
  std::size_t missed = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Pose2> path;
    const int shape = trial % 4;
    for (int i = 0; i < 3 + trial; ++i) {
      const double along_m = 0.07 * i;
      path.push_back(shape == 0   ? Pose2{along_m, 0.5, 0.0}
                     : shape == 1 ? Pose2{2.0 * std::sin(3.1 * along_m), std::cos(along_m), 0.0}
                     : shape == 2 ? Pose2{random.uniform(-4, 4), random.uniform(-1, 1), 0.0}
                                  : Pose2{std::abs(2.0 - along_m), 0.01 * i, 0.0});
    }
    const PathIndex index(path);
    const Point2 viewpoint = trial % 3 == 0 ? path[path.size() / 2].position()
                                            : Point2{random.uniform(-5, 5), random.uniform(-3, 3)};
    const double reach_m = random.uniform(0.5, 6.0);
    const auto distance_m = [&](const Pose2& pose) { return distance(pose.position(), viewpoint); };
    auto begin =
        static_cast<std::size_t>(std::ranges::min_element(path, {}, distance_m) - path.begin());
    std::size_t end = begin;
    while (end < path.size() && distance_m(path[end]) < reach_m) ++end;
    while (end > 0 && begin > 0 && distance_m(path[begin - 1]) < reach_m) --begin;
    const auto window = index.find_window(viewpoint, reach_m);
    ASSERT_EQ(window.has_value(), end >= begin + 2 && end > 0) << trial;
    if (!window) continue;
    ASSERT_EQ(window->begin, begin) << trial;
    ASSERT_EQ(window->end, end) << trial;
    for (const std::size_t count : {48U, 361U}) {
      const auto directions = equal_directions(count);
      std::vector<RouteCrossing> scanned(count);
      std::vector<RouteCrossing> found(count);
      find_crossings(std::span(path).subspan(begin, end - begin), begin, viewpoint, directions,
                     scanned);
      index.find_crossings(*window, viewpoint, directions, found);
      for (std::size_t c = 0; c < count; ++c) {
        ASSERT_EQ(found[c].along < 0.0F, scanned[c].along < 0.0F) << trial << " " << c;
        ++(found[c].along < 0.0F ? missed : crossed);
        EXPECT_NEAR(std::abs(found[c].distance_m), std::abs(scanned[c].distance_m), 1e-5);
        EXPECT_NEAR(found[c].along, scanned[c].along, 1e-3) << trial << " " << c;
      }
    }
  }
  EXPECT_GT(crossed, 10000U);
  EXPECT_GT(missed, 10000U);
}

TEST(RouteCrossing, ChangesWithTheViewpointAsItSays) {
  const auto path = smooth_path(std::vector<Point2>{{-3, 0}, {-1, 0.4}, {1, -0.3}, {3, 0.2}}, 0.1);
  const auto directions = equal_directions(72);
  const auto at = [&](Point2 viewpoint) {
    std::vector<RouteCrossing> crossings(72);
    find_crossings(path, 0, viewpoint, directions, crossings);
    return crossings;
  };
  constexpr double step = 1e-3;
  const Point2 here{0.3, 0.8};
  const auto now = at(here);
  const auto x = at({here.x_m + step, here.y_m});
  const auto y = at({here.x_m, here.y_m + step});
  int compared = 0;
  for (std::size_t c = 0; c < now.size(); ++c) {
    // On the same stretch of the path only.
    if (now[c].along < 0 || std::floor(now[c].along) != std::floor(x[c].along) ||
        std::floor(now[c].along) != std::floor(y[c].along)) {
      continue;
    }
    const double scale = 1.0 + std::abs(now[c].along_by_x) + std::abs(now[c].along_by_y);
    EXPECT_NEAR((x[c].along - now[c].along) / step, now[c].along_by_x, 0.05 * scale);
    EXPECT_NEAR((y[c].along - now[c].along) / step, now[c].along_by_y, 0.05 * scale);
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

TEST(RouteFit, FindsPosesBesideAStraightPath) {
  const ToyWorld room = pillared_room(5);
  for (const auto& [spacing_m, max_m] : {std::pair{0.02, 0.006}, std::pair{0.1, 0.012}}) {
    const RouteLines lines(record(room, straight_path(5.0, spacing_m)));
    Random random(11);
    double sum = 0.0;
    constexpr int trials = 40;
    for (int trial = 0; trial < trials; ++trial) {
      const Pose2 truth{random.uniform(-2.0, 2.0), random.uniform(-0.6, 0.6),
                        random.uniform(-std::numbers::pi, std::numbers::pi)};
      const double off = random.uniform(-std::numbers::pi, std::numbers::pi);
      const Pose2 predicted{truth.x_m + 0.3 * std::cos(off), truth.y_m + 0.3 * std::sin(off),
                            wrap_angle(truth.heading_rad + random.uniform(-0.15, 0.15))};
      const auto fix = lines.fit(room.line(truth), predicted);
      ASSERT_TRUE(fix.has_value());
      sum += distance(fix->pose.position(), truth.position()) / trials;
      EXPECT_GT(fix->correlation, 0.9);
      EXPECT_NEAR(angle_difference(fix->pose.heading_rad, truth.heading_rad), 0.0, radians(1.0));
    }
    EXPECT_LT(sum, max_m) << "mean error at a spacing of " << spacing_m;
  }
}

TEST(RouteFit, CurvedPathsAndHeadingsOfTheirOwn) {
  const ToyWorld room = pillared_room(8);
  auto path =
      smooth_path(std::vector<Point2>{{-2.5, -0.8}, {-1, 0.3}, {0.5, -0.2}, {2.3, 0.9}}, 0.05);
  Random random(4);
  for (Pose2& pose : path) pose.heading_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  const RouteLines lines(record(room, path));
  double sum = 0.0;
  constexpr int trials = 30;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose2 near = path[10 + random.index(path.size() - 20)];
    const Pose2 truth{near.x_m + random.uniform(-0.3, 0.3), near.y_m + random.uniform(-0.3, 0.3),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    const Pose2 predicted{truth.x_m + 0.1, truth.y_m - 0.1, wrap_angle(truth.heading_rad + 0.1)};
    const auto fix = lines.fit(room.line(truth), predicted);
    ASSERT_TRUE(fix.has_value());
    sum += distance(fix->pose.position(), truth.position()) / trials;
  }
  EXPECT_LT(sum, 0.01);
}

TEST(RouteFit, TheFrameOfTheWorldDoesNotMatter) {
  const ToyWorld room = pillared_room(9);
  const auto path = straight_path(4.0, 0.05);
  const Pose2 world{3.0, -7.0, 2.1};
  RoutePanorama here;
  RoutePanorama there;
  for (const Pose2& pose : path) {
    here.append(pose, room.line(pose));
    there.append(world * pose, room.line(pose));
  }
  const Pose2 truth{0.4, 0.3, 0.5};
  const Pose2 predicted{0.5, 0.25, 0.55};
  const auto a = RouteLines(here).fit(room.line(truth), predicted);
  const auto b = RouteLines(there).fit(room.line(truth), world * predicted);
  ASSERT_TRUE(a && b);
  const Pose2 back = inverse(world) * b->pose;
  EXPECT_NEAR(back.x_m, a->pose.x_m, 2e-3);
  EXPECT_NEAR(back.y_m, a->pose.y_m, 2e-3);
  EXPECT_NEAR(angle_difference(back.heading_rad, a->pose.heading_rad), 0.0, 2e-3);
}

TEST(RouteFit, AnotherLightChangesNothing) {
  const ToyWorld room = pillared_room(6);
  const RouteLines lines(record(room, straight_path(5.0, 0.05)));
  const Pose2 truth{0.2, 0.35, -0.4};
  auto line = room.line(truth);
  const auto plain = lines.fit(line, {0.3, 0.3, -0.35});
  for (float& value : line) value = 0.6F * value + 0.1F;
  const auto dark = lines.fit(line, {0.3, 0.3, -0.35});
  ASSERT_TRUE(plain && dark);
  EXPECT_NEAR(plain->pose.x_m, dark->pose.x_m, 1e-3);
  EXPECT_NEAR(plain->pose.y_m, dark->pose.y_m, 1e-3);
}

TEST(RouteFit, ChangedPartsCountLessAndAreReported) {
  ToyWorld room = pillared_room(12);
  const RouteLines lines(record(room, straight_path(5.0, 0.05)));
  const RouteLines trusting(record(room, straight_path(5.0, 0.05)), {.robust = false});
  room.move_pillar({0.5, 0.0});
  Random random(2);
  double robust = 0.0;
  double plain = 0.0;
  float changed = 0.0F;
  for (int trial = 0; trial < 20; ++trial) {
    const Pose2 truth{random.uniform(-1.5, 1.5), random.uniform(-0.3, 0.3),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    const auto line = room.line(truth);
    const auto a = lines.fit(line, truth);
    const auto b = trusting.fit(line, truth);
    ASSERT_TRUE(a && b);
    robust += distance(a->pose.position(), truth.position()) / 20;
    plain += distance(b->pose.position(), truth.position()) / 20;
    for (const float value : a->unexplained) {
      if (value > changed) changed = value;
    }
  }
  EXPECT_LT(robust, 0.6 * plain);
  EXPECT_GT(changed, 0.1F);
}

TEST(RouteFit, CovarianceIsThatOfTheNoise) {
  const ToyWorld room = pillared_room(14);
  const RouteLines lines(record(room, straight_path(5.0, 0.02)));
  const Pose2 truth{0.3, 0.25, 0.2};
  const auto clean = room.line(truth);
  Random random(21);
  double spread = 0.0;
  double expected = 0.0;
  constexpr int trials = 60;
  const auto middle = lines.fit(clean, truth);
  ASSERT_TRUE(middle.has_value());
  for (int trial = 0; trial < trials; ++trial) {
    auto line = clean;
    for (float& value : line) value += static_cast<float>(0.03 * random.normal());
    const auto fix = lines.fit(line, truth);
    ASSERT_TRUE(fix.has_value());
    spread += std::pow(fix->pose.x_m - middle->pose.x_m, 2) / trials;
    expected += fix->covariance[0] / trials;
  }
  EXPECT_GT(spread, 0.4 * expected);
  EXPECT_LT(spread, 2.5 * expected);
}

// Lines differ in whole surfaces: a fit from noise that is the same over some degrees is as much
// less certain as it has fewer independent values.
TEST(RouteFit, CovarianceAllowsForNoiseThatIsCorrelatedFromColumnToColumn) {
  const ToyWorld room = pillared_room(14);
  const RouteLines lines(record(room, straight_path(5.0, 0.02)));
  const Pose2 truth{0.3, 0.25, 0.2};
  const auto clean = room.line(truth);
  const auto middle = lines.fit(clean, truth);
  ASSERT_TRUE(middle.has_value());
  Random random(22);
  double spread = 0.0;
  double expected = 0.0;
  constexpr int trials = 60;
  constexpr std::size_t same = 6;  // columns of a degree
  for (int trial = 0; trial < trials; ++trial) {
    auto line = clean;
    double off = 0.0;
    for (std::size_t c = 0; c < line.size(); ++c) {
      if (c % same == 0) off = 0.03 * random.normal();
      line[c] += static_cast<float>(off);
    }
    const auto fix = lines.fit(line, truth);
    ASSERT_TRUE(fix.has_value());
    spread += std::pow(fix->pose.x_m - middle->pose.x_m, 2) / trials;
    expected += fix->covariance[0] / trials;
  }
  EXPECT_GT(spread, 0.2 * expected);
  EXPECT_LT(spread, expected);
}

TEST(RouteFit, SynthesisShowsWhatIsSeen) {
  const ToyWorld room = pillared_room(15);
  const RouteLines lines(record(room, straight_path(5.0, 0.02)));
  const Pose2 pose{0.5, 0.2, 0.8};
  const auto shown = lines.synthesise(pose);
  const auto seen = room.line(pose);
  double off = 0.0;
  int count = 0;
  for (std::size_t c = 0; c < seen.size(); ++c) {
    if (!std::isfinite(shown[c])) continue;
    off += std::abs(shown[c] - seen[c]);
    ++count;
  }
  EXPECT_GT(count, 300);
  EXPECT_LT(off / count, 0.02);
}

TEST(RouteFit, NoAnswerRatherThanAWrongOne) {
  const ToyWorld room = pillared_room(1);
  const RouteLines lines(record(room, straight_path(2.0, 0.05)), {.reach_m = 1.0});
  EXPECT_FALSE(lines.fit(room.line({0, 0, 0}), {0.0, 5.0, 0.0}).has_value());
  EXPECT_FALSE(lines.fit(std::vector<float>(360, 0.5F), {0, 0, 0}).has_value());
  EXPECT_THROW((void)lines.fit(std::vector<float>(90, 0.5F), {0, 0, 0}), ContractError);
  RoutePanorama one;
  one.append({0, 0, 0}, room.line({0, 0, 0}));
  EXPECT_THROW((void)RouteLines(one), ContractError);
  EXPECT_THROW((void)RouteLines(record(room, straight_path(2.0, 0.05)), {.levels = 0}),
               OptionError);
}

TEST(RoutePanorama, RefusesWhatDoesNotFit) {
  EXPECT_THROW((void)RoutePanorama(3), ContractError);
  RoutePanorama route(16);
  EXPECT_THROW((void)route.append({0, 0, 0}, std::vector<float>(15, 0.0F)), ContractError);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW((void)route.append({0, 0, 0}, std::vector<float>(16, nan)), ContractError);
  EXPECT_THROW((void)route.append({nan, 0, 0}, std::vector<float>(16, 0.0F)), ContractError);
  EXPECT_TRUE(route.empty());
  EXPECT_TRUE(route.append({0, 0, 0}, std::vector<float>(16, 2.0F)));
  EXPECT_EQ(route.line(0)[3], 255);
  EXPECT_FALSE(route.append({1e-5, 0, 1.0}, std::vector<float>(16, 0.0F)));
  EXPECT_TRUE(route.append({0.1, 0, 0}, std::vector<float>(16, 0.0F)));
  EXPECT_NEAR(route.length_m(), 0.1, 1e-12);
}

// Smoothed lines may lead away from a good prediction. The better of both ways is the answer.
TEST(RouteFit, ExplainsAtLeastAsMuchAsWithoutSmoothing) {
  Random random(21);
  int better = 0;
  for (const std::uint64_t seed : {31U, 32U, 33U}) {
    const ToyWorld room = pillared_room(seed);
    const RoutePanorama route = record(room, straight_path(4.0, 0.05));
    const RouteLines lines(route);
    const RouteLines plain(route, {.levels = 1});
    for (int trial = 0; trial < 20; ++trial) {
      const Pose2 truth{random.uniform(-1.0, 1.0), random.uniform(-0.4, 0.4),
                        random.uniform(-std::numbers::pi, std::numbers::pi)};
      const Pose2 predicted = truth * Pose2{0.3 * random.normal(), 0.3 * random.normal(), 0.1};
      const auto line = room.line(truth);
      const auto direct = plain.fit(line, predicted);
      const auto found = lines.fit(line, predicted);
      ASSERT_TRUE(direct && found);
      EXPECT_GE(found->correlation, direct->correlation - 1e-9) << trial;
      better += static_cast<int>(found->correlation > direct->correlation + 1e-6);
    }
  }
  // Smoothing is not for nothing.
  EXPECT_GT(better, 0);
}

}  // namespace
}  // namespace panonav::testing
