#include "panonav/route/route_tracker.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/smooth_path.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

/// A hall of 8 m by 3 m whose walls have stripes of random grey.
class StripedHall {
 public:
  /// `is_symmetric`: looks the same after half a turn about its centre, (2, 0).
  explicit StripedHall(std::uint64_t seed, bool is_symmetric = false)
      : is_symmetric_(is_symmetric) {
    Random random(seed);
    for (auto& wall : grey_) {
      for (double& stripe : wall) stripe = random.uniform(0.0, 1.0);
    }
  }
  /// Returns the line of a robot that looks along the hall.
  [[nodiscard]] std::vector<float> line(Point2 position) const {
    constexpr int columns = 360;
    constexpr int rays = 8;
    std::vector<float> values(columns, 0.0F);
    for (int i = 0; i < columns * rays; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.5 - 0.5 * rays) / (columns * rays);
      const double x = std::cos(angle);
      const double y = std::sin(angle);
      const double to_end_m = ((x > 0.0 ? 6.0 : -2.0) - position.x_m) / x;
      const double to_side_m = ((y > 0.0 ? 1.5 : -1.5) - position.y_m) / y;
      const bool is_end = to_end_m < to_side_m;
      double along_m = is_end ? position.y_m + to_end_m * y : position.x_m + to_side_m * x;
      std::size_t wall = (is_end ? 0U : 2U) + ((is_end ? x : y) > 0.0 ? 1U : 0U);
      if (is_symmetric_ && wall % 2 == 0) {
        along_m = (is_end ? 0.0 : 4.0) - along_m;
        ++wall;
      }
      const auto stripe = static_cast<std::size_t>((along_m + 3.0) / stripe_m);
      values[static_cast<std::size_t>(i / rays)] += static_cast<float>(grey_[wall][stripe] / rays);
    }
    return values;
  }

 private:
  static constexpr double stripe_m = 0.15;
  bool is_symmetric_;
  std::array<std::array<double, 100>, 4> grey_{};
};

/// True if the truth is within the ellipse that holds 95 % by the covariance of the fix.
bool is_within_ellipse(const RouteFix& fix, const Pose2& truth) {
  constexpr double square_95 = 5.991;  // chi squared, two degrees of freedom
  const auto& c = fix.covariance;
  const double x_m = fix.pose.x_m - truth.x_m;
  const double y_m = fix.pose.y_m - truth.y_m;
  return c[4] * x_m * x_m - 2.0 * c[1] * x_m * y_m + c[0] * y_m * y_m <=
         square_95 * (c[0] * c[4] - c[1] * c[1]);
}

class RouteTracking : public ::testing::Test {
 protected:
  RouteTracking() {
    path = smooth_path(std::vector<Point2>{{-3, -0.8}, {-1.2, 0.5}, {0.6, -0.3}, {2.8, 0.6}}, 0.1);
    for (const Pose2& pose : path) route.append(pose, room.line(pose));
  }

  [[nodiscard]] Pose2 beside(std::size_t i, double lateral_m, double turn_rad) const {
    return path[i] * Pose2{0.0, lateral_m, turn_rad};
  }

  ToyWorld room = pillared_room(31);
  std::vector<Pose2> path;
  RoutePanorama route;
};

TEST_F(RouteTracking, FindsTheRobotWithoutAPrediction) {
  const RouteTracker tracker(route);
  Random random(5);
  int found = 0;
  constexpr int trials = 30;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose2 truth = beside(5 + random.index(path.size() - 10), random.uniform(-0.4, 0.4),
                               random.uniform(-std::numbers::pi, std::numbers::pi));
    const auto fix = tracker.search(room.line(truth));
    if (!fix) continue;
    EXPECT_EQ(fix->origin, RouteFix::Origin::search);
    if (distance(fix->pose.position(), truth.position()) < 0.05) ++found;
  }
  EXPECT_GE(found, 28);
}

TEST_F(RouteTracking, SaysThatAnotherPlaceIsNotOnThisRoute) {
  RouteTracker tracker(route);
  Random random(6);
  int refused = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const ToyWorld other = pillared_room(500 + static_cast<std::uint64_t>(trial));
    const Pose2 there{random.uniform(-2.0, 2.0), random.uniform(-0.8, 0.8),
                      random.uniform(-std::numbers::pi, std::numbers::pi)};
    refused += tracker.search(other.line(there)) ? 0 : 1;
  }
  EXPECT_GE(refused, 36);
  EXPECT_FALSE(tracker.search(std::vector<float>(360, 0.3F)).has_value());
  EXPECT_FALSE(tracker.track(std::vector<float>(360, 0.3F), {0.1, 0, 0}).has_value());
  EXPECT_FALSE(tracker.pose().has_value());
}

// Limits learnt from a route hold in other worlds: of the lines from elsewhere at most one in a
// hundred is answered, and the lines from the route are.
TEST(RouteLimits, RefuseOtherWorldsAndKeepTheirOwn) {
  constexpr std::uint64_t worlds = 6;
  constexpr int trials = 25;
  std::vector<ToyWorld> rooms;
  for (std::uint64_t world = 0; world < worlds; ++world) {
    rooms.push_back(pillared_room(900 + 7 * world));
  }
  Random random(11);
  const auto draw_pose = [&] {
    return Pose2{random.uniform(-1.8, 1.8), random.uniform(-0.3, 0.3),
                 random.uniform(-std::numbers::pi, std::numbers::pi)};
  };
  int foreign = 0;
  int own = 0;
  for (std::size_t world = 0; world < worlds; ++world) {
    RoutePanorama route;
    for (int i = 0; i <= 40; ++i) {
      const Pose2 pose{0.1 * i - 2.0, 0.1 * std::sin(0.2 * i), 0.0};
      route.append(pose, rooms[world].line(pose));
    }
    const RouteTracker tracker(route);
    EXPECT_GT(tracker.limits().min_detail_correlation, 0.0);
    for (std::size_t other = 0; other < worlds; ++other) {
      for (int trial = 0; trial < trials; ++trial) {
        const bool found = tracker.search(rooms[other].line(draw_pose())).has_value();
        (other == world ? own : foreign) += found ? 1 : 0;
      }
    }
  }
  std::printf("%d foreign and %d own lines found\n", foreign, own);
  EXPECT_LE(foreign, static_cast<int>(0.01 * worlds * (worlds - 1) * trials));
  EXPECT_GE(own, static_cast<int>(0.95 * worlds * trials));
}

// Images from past the ends of short routes look like those of the end, but few of their lines of
// sight cross the route. The robot is then lost, or within the stated ellipse.
TEST(RouteLimits, RefuseImagesFromPastTheEndsOfShortRoutes) {
  constexpr double length_m = 1.5;
  int tested = 0;
  int wrong = 0;
  int refused = 0;
  int within = 0;
  int found = 0;
  for (std::uint64_t world = 0; world < 8; ++world) {
    const ToyWorld room = pillared_room(60 + world);
    RoutePanorama route;
    for (int i = 0; i <= 15; ++i) {
      const Pose2 pose{0.1 * i - 0.75, -0.2, 0.0};
      route.append(pose, room.line(pose));
    }
    const RouteTracker tracker(route);
    for (const double y_m : {-0.2, -0.1, -0.35}) {
      for (int i = 1; i <= 8; ++i) {
        for (const double past_m : {-0.05 * i, length_m + 0.05 * i}) {
          const Pose2 robot{past_m - 0.75, y_m, 0.4};
          const auto fix = tracker.search(room.line(robot));
          ++tested;
          refused += fix ? 0 : 1;
          if (!fix || distance(fix->pose.position(), robot.position()) < 0.05) continue;
          wrong += is_within_ellipse(*fix, robot) ? 0 : 1;
        }
        const Pose2 robot{length_m * i / 9.0 - 0.75, y_m, 0.4};
        const auto fix = tracker.search(room.line(robot));
        ++within;
        if (fix && distance(fix->pose.position(), robot.position()) < 0.05) ++found;
      }
    }
  }
  std::printf("%d of %d past the ends wrong, %d refused; %d of %d found within\n", wrong, tested,
              refused, found, within);
  EXPECT_GT(refused, tested / 2);
  EXPECT_LE(wrong, tested / 200);
  EXPECT_GE(found, within * 95 / 100);
}

// A robot at an end is on the route, though by its pose, which is off by millimetres, half of its
// lines of sight may miss the path.
TEST(RouteEnds, ARobotThatStandsAtAnEndIsFound) {
  int tested = 0;
  int found = 0;
  int within = 0;
  for (std::uint64_t world = 0; world < 4; ++world) {
    const ToyWorld room = pillared_room(60 + world);
    const auto path =
        smooth_path(std::vector<Point2>{{-3, -0.8}, {-1.2, 0.5}, {0.6, -0.3}, {2.8, 0.6}}, 0.1);
    RoutePanorama route;
    for (const Pose2& pose : path) route.append(pose, room.line(pose));
    const RouteTracker tracker(route);
    for (const Pose2& end : {path.front(), path.back()}) {
      for (const double along_m : {-0.04, -0.02, 0.0, 0.02, 0.04}) {
        for (const double lateral_m : {-0.02, 0.0, 0.02}) {
          const Pose2 robot = end * Pose2{along_m, lateral_m, 0.4};
          const auto fix = tracker.search(room.line(robot));
          ++tested;
          if (!fix) continue;
          ++found;
          within += is_within_ellipse(*fix, robot) ? 1 : 0;
          EXPECT_LT(distance(fix->pose.position(), robot.position()), 0.1);
        }
      }
    }
  }
  std::printf("%d of %d at the ends found, %d within the ellipse\n", found, tested, within);
  EXPECT_GE(found, tested * 99 / 100);
  EXPECT_GE(within, found * 9 / 10);
}

// A round ends where it begins, though by drifting odometry elsewhere: both positions are right.
TEST(RouteEnds, ARobotAtTheBeginningOfARoundIsFoundThoughItsEndHasDrifted) {
  constexpr double drift_m = 0.8;
  int found = 0;
  constexpr std::uint64_t worlds = 6;
  for (std::uint64_t world = 0; world < worlds; ++world) {
    const ToyWorld room = pillared_room(60 + world);
    const auto path = smooth_path(
        std::vector<Point2>{{-3, -0.8}, {2.6, -0.8}, {2.6, 0.8}, {-3, 0.8}, {-3, -0.8}}, 0.1);
    RoutePanorama route;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(path.size());
      route.append(Pose2{path[i].x_m, path[i].y_m + share * drift_m, path[i].heading_rad},
                   room.line(path[i]));
    }
    const auto fix = RouteTracker(route).search(room.line(path.front() * Pose2{0.02, 0.0, 0.3}));
    if (!fix) continue;
    ++found;
    EXPECT_LT(std::min(distance(fix->pose.position(), route.poses().front().position()),
                       distance(fix->pose.position(), route.poses().back().position())),
              0.1);
  }
  EXPECT_GE(found, static_cast<int>(worlds) - 1);
}

// Two half turns of a hall whose ends and sides look like each other cannot be distinguished.
TEST(RouteLimits, APlaceThatLooksLikeAnotherIsNotAnswered) {
  int tested = 0;
  int answered = 0;
  for (std::uint64_t world = 0; world < 3; ++world) {
    const StripedHall hall(world, true);
    RoutePanorama route;
    for (int i = 0; i <= 40; ++i) route.append(Pose2{0.1 * i, 0.0, 0.0}, hall.line({0.1 * i, 0.0}));
    const RouteTracker tracker(route);
    for (int i = 3; i < 38; i += 4) {
      if (std::abs(i - 20) < 6) continue;  // near the middle both are one place
      ++tested;
      answered += tracker.search(hall.line({0.1 * i + 0.03, 0.05})) ? 1 : 0;
    }
  }
  std::printf("%d of %d of two possible positions answered\n", answered, tested);
  EXPECT_GE(tested, 15);
  EXPECT_LE(answered, 1);
}

// A route with so few lines that they do not predict those between them.
TEST(RouteLimits, RefuseOtherWorldsWhereLinesAreFarApart) {
  int tested = 0;
  int foreign = 0;
  for (std::uint64_t world = 0; world < 6; ++world) {
    const ToyWorld room = pillared_room(900 + world);
    RoutePanorama route;
    for (int i = 0; i < 12; ++i) {
      const Pose2 pose{2.5 * std::cos(1.7 * i), std::sin(2.3 * i), 0.9 * i};
      route.append(pose, room.line(pose));
    }
    const RouteTracker tracker(route);
    for (std::uint64_t other = 0; other < 30; ++other) {
      const ToyWorld elsewhere = pillared_room(1000 + other);
      ++tested;
      foreign +=
          tracker.search(elsewhere.line({0.05 * static_cast<double>(other), 0.1, 0.3})) ? 1 : 0;
    }
  }
  std::printf("%d of %d foreign lines found\n", foreign, tested);
  EXPECT_LE(foreign, tested / 50);
}

// At the ends of a short, straight route few lines of sight cross it. The robot is then found where
// it is, or not at all.
TEST_F(RouteTracking, TheEndsOfAShortRouteGiveNoWrongPosition) {
  RoutePanorama straight;
  for (int i = 0; i <= 15; ++i) {
    const Pose2 pose{0.1 * i - 0.7, -0.2, 0.0};
    straight.append(pose, room.line(pose));
  }
  const RouteTracker tracker(straight);
  int found = 0;
  for (const double y_m : {-0.2, -0.17, -0.3}) {
    for (int i = -4; i <= 34; ++i) {
      const Pose2 robot{0.05 * i - 0.7, y_m, 0.4};
      const auto fix = tracker.search(room.line(robot));
      if (!fix) continue;
      EXPECT_LT(distance(fix->pose.position(), robot.position()), 0.1) << i << " " << y_m;
      EXPECT_GE(2 * fix->columns, straight.columns());
      ++found;
    }
  }
  EXPECT_GE(found, 60);
}

// Errors of the fit exceed what the noise of the lines explains, most of all between the lines of
// the route.
TEST_F(RouteTracking, TheStatedCovarianceHolds) {
  const RouteTracker tracker(route);
  Random random(7);
  int found = 0;
  int within = 0;
  int within_noise = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const Pose2 truth = path[5 + random.index(path.size() - 10)] *
                        Pose2{random.uniform(0.0, 0.1), random.uniform(-0.5, 0.5), 0.2};
    const auto line = room.line(truth);
    const auto fix = tracker.search(line);
    if (!fix) continue;
    ++found;
    within += is_within_ellipse(*fix, truth) ? 1 : 0;
    const auto by_noise = tracker.lines().fit(line, fix->pose);
    ASSERT_TRUE(by_noise.has_value());
    within_noise += is_within_ellipse(*by_noise, truth) ? 1 : 0;
  }
  std::printf("%d of %d within the ellipse, %d by the noise alone\n", within, found, within_noise);
  EXPECT_GE(found, 130);
  EXPECT_GE(within, 0.9 * found);
  EXPECT_LT(within_noise, within);
}

// Blended lines move a fit along the path, except midway between them, where lines that are left
// out of half a route are. At a quarter of the way the error is largest, so that fewer than 95 %
// hold.
TEST(RouteCovariance, HoldsAtAnyPositionBetweenTwoLines) {
  constexpr double spacing_m = 0.1;
  int found = 0;
  int within = 0;
  std::vector<double> errors_m;
  std::vector<double> radii_m;
  for (std::uint64_t world = 0; world < 3; ++world) {
    const StripedHall hall(world);
    RoutePanorama route;
    for (int i = 0; i <= 40; ++i)
      route.append(Pose2{spacing_m * i, 0.0, 0.0}, hall.line({spacing_m * i, 0.0}));
    const RouteTracker tracker(route);
    for (int i = 2; i < 38; ++i) {
      const Pose2 truth{spacing_m * (i + (i % 2 == 0 ? 0.25 : 0.75)), 0.0, 0.0};
      const auto fix = tracker.search(hall.line(truth.position()));
      if (!fix) continue;
      ++found;
      within += is_within_ellipse(*fix, truth) ? 1 : 0;
      errors_m.push_back(distance(fix->pose.position(), truth.position()));
      radii_m.push_back(2.448 * std::sqrt(0.5 * (fix->covariance[0] + fix->covariance[4])));
    }
  }
  std::printf("%d of %d within the ellipse; median error %.4f m, radius %.4f m\n", within, found,
              median(errors_m), median(radii_m));
  EXPECT_GE(found, 100);
  EXPECT_GE(within, 0.8 * found);
  EXPECT_LE(median(radii_m), 6.0 * median(errors_m));
}

TEST_F(RouteTracking, FollowsADriveAndTellsWayAndSide) {
  RouteTracker tracker(route);
  Pose2 robot = beside(4, 0.2, 0.3);
  ASSERT_TRUE(tracker.track(room.line(robot), {}).has_value());
  for (std::size_t i = 6; i + 4 < path.size(); i += 2) {
    const Pose2 next = beside(i, 0.2, 0.3);
    Pose2 step = inverse(robot) * next;
    step.x_m *= 1.1;  // slipping wheels
    step.heading_rad += 0.03;
    const auto fix = tracker.track(room.line(next), step);
    ASSERT_TRUE(fix.has_value());
    EXPECT_EQ(fix->origin, RouteFix::Origin::prediction);
    EXPECT_NEAR(fix->lateral_m, 0.2, 0.03);
    EXPECT_NEAR(fix->along_m, 0.1 * static_cast<double>(i), 0.06);
    EXPECT_LT(distance(fix->pose.position(), next.position()), 0.03);
    robot = next;
  }
}

// At the crossing of an eight both passes are equally near.
TEST_F(RouteTracking, StaysOnItsPassWhereTheRouteCrossesItself) {
  const auto eight = smooth_path(
      std::vector<Point2>{{-2, -0.6}, {1.6, 0.6}, {2.2, 0}, {1.6, -0.6}, {-2, 0.6}}, 0.1);
  RoutePanorama crossing(route.columns());
  std::vector<double> along_m{0.0};
  for (std::size_t i = 0; i < eight.size(); ++i) {
    crossing.append(eight[i], room.line(eight[i]));
    if (i > 0) {
      along_m.push_back(along_m.back() + distance(eight[i - 1].position(), eight[i].position()));
    }
  }
  RouteTracker tracker(crossing);
  for (const double lateral_m : {0.0, 0.15, -0.15}) {
    tracker.reset();
    Pose2 robot;
    for (std::size_t i = 2; i + 2 < eight.size(); ++i) {
      const Pose2 next = eight[i] * Pose2{0.0, lateral_m, 0.1};
      const auto fix = tracker.track(room.line(next), i == 2 ? Pose2{} : inverse(robot) * next);
      robot = next;
      if (!fix) continue;
      EXPECT_NEAR(fix->along_m, along_m[i], 0.25) << i << ", lateral " << lateral_m;
      EXPECT_NEAR(fix->lateral_m, lateral_m, 0.1) << i;
    }
  }
}

TEST_F(RouteTracking, RecoversWhenThePredictionIsOff) {
  Random random(8);
  int right = 0;
  constexpr int trials = 40;
  RouteTracker tracker(route);
  for (int trial = 0; trial < trials; ++trial) {
    const Pose2 truth = beside(8 + random.index(path.size() - 16), random.uniform(-0.2, 0.2),
                               random.uniform(-std::numbers::pi, std::numbers::pi));
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi);
    tracker.set_pose({truth.x_m + 0.5 * std::cos(angle), truth.y_m + 0.5 * std::sin(angle),
                      wrap_angle(truth.heading_rad + random.uniform(-0.3, 0.3))});
    const auto fix = tracker.track(room.line(truth), {});
    if (fix && distance(fix->pose.position(), truth.position()) < 0.05) ++right;
  }
  EXPECT_GE(right, 38);
}

TEST_F(RouteTracking, CarriesOdometryThroughABlindStretch) {
  RouteTracker tracker(route);
  tracker.set_pose(beside(10, 0.0, 0.0));
  const std::vector<float> dark(360, 0.0F);
  EXPECT_FALSE(tracker.track(dark, {0.1, 0.0, 0.0}).has_value());
  ASSERT_TRUE(tracker.pose().has_value());
  EXPECT_LT(distance(tracker.pose()->position(), (path[10] * Pose2{0.1, 0, 0}).position()), 1e-9);
  tracker.reset();
  EXPECT_FALSE(tracker.pose().has_value());
}

TEST_F(RouteTracking, ChecksItsInputs) {
  EXPECT_THROW((void)RouteTracker(route, {}, {}, RouteLimits{.min_correlation = 1.5}),
               ContractError);
  EXPECT_THROW((void)RouteTracker(route, {}, {}, RouteLimits{.detail_scale = 4}), ContractError);
  EXPECT_THROW((void)RouteTracker(route, {.search_step_m = 0.0}), OptionError);
  RouteTracker tracker(route, {.min_correlation = 0.8});
  EXPECT_EQ(tracker.limits().min_correlation, 0.8);
  EXPECT_THROW((void)tracker.search(std::vector<float>(10, 0.0F)), ContractError);
  EXPECT_THROW((void)tracker.track(std::vector<float>(10, 0.0F), {}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
