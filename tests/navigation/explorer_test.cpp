#include "panonav/navigation/explorer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/navigation/internal/explorer_pose.hpp"
#include "support/random_views.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav {
namespace {

using State = ExplorationDecision::State;
constexpr double robot_radius_m = 0.2;

struct Exploration {
  State end = State::exploring;
  std::vector<Pose2> views;      // true poses
  std::vector<Pose2> estimates;  // estimated poses of the views, in the frame of the first
  std::vector<Pose2> contacts;   // true poses, heading: the course
  double driven_m = 0.0;
  double end_distance_m = 0.0;
};

/// Explores a world of walls with a robot that turns and drives straight until it touches
/// something.
class ToyRobot {
 public:
  ToyRobot(const testing::ToyWorld& world, const Pose2& start, bool has_ranges, std::uint64_t seed)
      : world_(world), pose_(start), has_ranges_(has_ranges), noise_(seed) {}

  Exploration explore(const ExplorationOptions& options = {}) {
    Explorer explorer(options, robot_radius_m, has_ranges_, wheels_);
    const Pose2 start = pose_;
    Exploration run;
    ExplorationReport report;
    std::vector<ExplorationReport::Range> ranges;
    for (int i = 0; i < 2000; ++i) {
      if (has_ranges_) ranges = measure_ranges();
      report.ranges = ranges;
      const auto decision =
          explorer.observe(testing::two_rooms_signature(world_, pose_, noise_), report);
      run.end = decision.state;
      if (decision.memorise) run.views.push_back(pose_);
      if (decision.state == State::done || decision.state == State::lost) break;
      report = drive(decision);
      run.driven_m += std::hypot(report.moved.x_m, report.moved.y_m);
      if (report.contact_rad) run.contacts.push_back(pose_);
    }
    run.estimates.assign(explorer.view_poses().begin(), explorer.view_poses().end());
    run.end_distance_m = distance(pose_.position(), start.position());
    return run;
  }

 private:
  [[nodiscard]] std::vector<ExplorationReport::Range> measure_ranges() const {
    std::vector<ExplorationReport::Range> ranges;
    for (int k = 0; k < 8; ++k) {
      const double direction_rad = k * std::numbers::pi / 4.0;
      double length_m = 0.0;
      while (length_m < 3.0 &&
             world_.clearance_m(pose_ * Point2{length_m * std::cos(direction_rad),
                                               length_m * std::sin(direction_rad)}) > 0.02) {
        length_m += 0.02;
      }
      ranges.push_back({direction_rad, length_m, length_m < 3.0});
    }
    return ranges;
  }

  ExplorationReport drive(const ExplorationDecision& decision) {
    constexpr double piece_m = 0.01;
    ExplorationReport report;
    const Pose2 turn{0.0, 0.0, decision.direction_rad};
    pose_ = pose_ * sample_step(turn, wheels_, noise_);
    report.moved = turn;
    for (double driven_m = 0.0; driven_m < decision.advance_m; driven_m += piece_m) {
      const Pose2 piece{std::min(piece_m, decision.advance_m - driven_m), 0.0, 0.0};
      const Pose2 next = pose_ * sample_step(piece, wheels_, noise_);
      if (world_.clearance_m(next.position()) < robot_radius_m) {
        report.contact_rad = find_contact_rad();
        break;
      }
      pose_ = next;
      report.moved = report.moved * piece;
    }
    return report;
  }

  // The side of the nearest obstacle, as one of eight.
  [[nodiscard]] double find_contact_rad() const {
    double nearest_m = std::numeric_limits<double>::infinity();
    double contact_rad = 0.0;
    for (int k = 0; k < 8; ++k) {
      const double direction_rad = k * std::numbers::pi / 4.0;
      const double clearance_m =
          world_.clearance_m(pose_ * Point2{robot_radius_m * std::cos(direction_rad),
                                            robot_radius_m * std::sin(direction_rad)});
      if (clearance_m >= nearest_m) continue;
      nearest_m = clearance_m;
      contact_rad = direction_rad;
    }
    return contact_rad;
  }

  const testing::ToyWorld& world_;
  Pose2 pose_;
  bool has_ranges_;
  Random noise_;
  OdometryNoise wheels_;
};

// The share of the free floor of `two_rooms` within `radius_m` of a view.
double covered_share(const testing::ToyWorld& world, const std::vector<Pose2>& views,
                     double radius_m) {
  int free = 0;
  int covered = 0;
  for (double x_m = 0.1; x_m < 8.0; x_m += 0.1) {
    for (double y_m = 0.1; y_m < 4.0; y_m += 0.1) {
      if (world.clearance_m({x_m, y_m}) < robot_radius_m) continue;
      ++free;
      covered += std::ranges::any_of(views,
                                     [&](const Pose2& view) {
                                       return distance(view.position(), {x_m, y_m}) <= radius_m;
                                     })
                     ? 1
                     : 0;
    }
  }
  return static_cast<double>(covered) / free;
}

TEST(Explorer, CoversFloorInBothRooms) {
  const testing::ToyWorld world = testing::two_rooms(9001, false);
  const Exploration run =
      ToyRobot(world, {0.8, 1.0, 0.3}, true, 9002).explore({.max_metres = 30.0});
  EXPECT_GT(covered_share(world, run.views, 0.5), 0.5);  // one of the rooms has half of the floor
  EXPECT_TRUE(std::ranges::any_of(run.views, [](const Pose2& view) { return view.x_m > 5.0; }));
  ASSERT_EQ(run.estimates.size(), run.views.size());
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < run.views.size(); ++i) {
    const Pose2 truth = inverse(run.views.front()) * run.views[i];
    errors_m.push_back(distance(truth.position(), run.estimates[i].position()));
  }
  // The small pictures of this world show turns with systematic errors; the rooms are 8 m long.
  EXPECT_LE(upper_median(errors_m), 1.0);
}

TEST(Explorer, WithABumperAloneItSeldomTriesTheSameWayAgain) {
  const testing::ToyWorld world = testing::two_rooms(9003, false);
  const Exploration run =
      ToyRobot(world, {0.8, 1.0, 0.3}, false, 9004).explore({.max_metres = 25.0});
  EXPECT_EQ(run.end, State::done);
  EXPECT_GE(run.contacts.size(), 10U);
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < run.contacts.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Pose2 other = inverse(run.contacts[k]) * run.contacts[i];
      repeated += std::hypot(other.x_m, other.y_m) < 0.04 && std::abs(other.heading_rad) < 0.2;
    }
  }
  // It does so where its map contradicted itself.
  EXPECT_LE(repeated, run.contacts.size() / 4);
}

// Memorises views every 0.4 m along a line of 2 m, and then at (2, 1), where odometry that slips
// takes the robot to be `slip_m` farther ahead. `look` returns the view at a pose.
template <class Look>
Pose2 memorise_after_slip(const Look& look, double slip_m) {
  ExplorerPose robot(0.5, OdometryNoise{.translation_scale_error = 0.5});
  constexpr double step_m = 0.4;
  for (int i = 0; i <= 5; ++i) {
    if (i > 0) robot.move({step_m, 0.0, 0.0});
    const OdometryView view(look(Pose2{1.0 + i * step_m, 1.0, 0.0}));
    robot.add_view(view, robot.correct(view));
  }
  robot.move({-1.0 + slip_m, 0.0, 0.0});
  const OdometryView view(look(Pose2{2.0, 1.0, 0.0}));
  robot.add_view(view, robot.correct(view));
  return robot.pose();
}

TEST(ExplorerPose, AViewOfAKnownPlaceCorrectsAPoseThatSlipped) {
  const testing::ToyWorld world = testing::two_rooms(9013, false);
  Random noise(3);
  const auto look = [&](const Pose2& pose) {
    return testing::two_rooms_signature(world, pose, noise);
  };
  for (const double slip_m : {0.0, 2.0, 4.0}) {
    EXPECT_NEAR(memorise_after_slip(look, slip_m).x_m, 1.0, 0.5) << slip_m;
  }
}

TEST(ExplorerPose, AViewOfANewPlaceLeavesThePoseToOdometry) {
  Random random(4);
  const auto look = [&](const Pose2&) { return testing::random_signature(random, {16, 15}); };
  EXPECT_NEAR(memorise_after_slip(look, 4.0).x_m, 5.0, 0.05);
}

TEST(Explorer, TheSameCallsGiveTheSameBits) {
  const testing::ToyWorld world = testing::two_rooms(9005, true);
  const auto explore = [&] {
    return ToyRobot(world, {0.8, 1.0, 0.3}, true, 9006).explore({.max_metres = 10.0});
  };
  const Exploration first = explore();
  const Exploration second = explore();
  EXPECT_GE(first.views.size(), 5U);
  EXPECT_EQ(first.views, second.views);
  EXPECT_EQ(first.estimates, second.estimates);
}

TEST(Explorer, EndsWhereItIsAllowedToDriveNoFarther) {
  const testing::ToyWorld world = testing::two_rooms(9005, true);
  const Exploration run =
      ToyRobot(world, {0.8, 1.0, 0.3}, true, 9006).explore({.max_metres = 10.0});
  EXPECT_EQ(run.end, State::done);
  EXPECT_GE(run.driven_m, 10.0);
  EXPECT_LE(run.driven_m, 20.0);
  EXPECT_LT(covered_share(world, run.views, 0.5), 0.9);
}

TEST(Explorer, FirstViewIsAlwaysMemorisedAndTheMapNamesAllViews) {
  Explorer explorer({}, robot_radius_m, true);
  const testing::ToyWorld world = testing::two_rooms(9007, true);
  Random noise(9008);
  const auto first = explorer.observe(testing::two_rooms_signature(world, {1.0, 1.0, 0.0}, noise));
  EXPECT_TRUE(first.memorise);
  const std::vector<ViewId> ids{ViewId{7}};
  const TopologicalMap map = explorer.map(ids);
  ASSERT_EQ(map.nodes.size(), 1U);
  EXPECT_EQ(map.nodes.front().view, ViewId{7});
  EXPECT_EQ(map.nodes.front().pose, Pose2{});
  EXPECT_THROW(static_cast<void>(explorer.map({})), ContractError);
}

TEST(Explorer, IsLostWhereImagesShowNoViewAnyMore) {
  const testing::ToyWorld world = testing::two_rooms(9009, true);
  Random noise(9010);
  Explorer explorer({}, robot_radius_m, false);
  static_cast<void>(explorer.observe(testing::two_rooms_signature(world, {1.0, 1.0, 0.0}, noise)));
  State state = State::exploring;
  bool has_recovered = false;
  const SignatureShape shape = testing::two_rooms_signature(world, {1.0, 1.0, 0.0}, noise).shape();
  for (int i = 0; i < 200 && state != State::lost && state != State::done; ++i) {
    const auto decision =
        explorer.observe(testing::random_signature(noise, shape), {.moved = {0.2, 0.0, 0.1}});
    state = decision.state;
    has_recovered |= state == State::recovering;
  }
  EXPECT_TRUE(has_recovered);
  EXPECT_EQ(state, State::lost);
}

TEST(Explorer, RejectsBadOptionsAndReports) {
  EXPECT_THROW(Explorer({.radius_m = 0.0}, robot_radius_m, true), OptionError);
  EXPECT_THROW(Explorer({.step_m = -1.0}, robot_radius_m, true), OptionError);
  EXPECT_THROW(Explorer({}, -0.1, true), ContractError);
  Explorer explorer({}, robot_radius_m, true);
  const testing::ToyWorld world = testing::two_rooms(9011, true);
  Random noise(9012);
  const auto view = testing::two_rooms_signature(world, {1.0, 1.0, 0.0}, noise);
  EXPECT_THROW(static_cast<void>(explorer.observe(
                   view, {.moved = {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}})),
               ContractError);
}

}  // namespace
}  // namespace panonav
