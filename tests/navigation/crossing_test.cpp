// A robot drives from one piece of an arrangement into another: only a crossing connects the two.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/navigator.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

constexpr double crossing_spacing_m = 0.3;
constexpr Point2 far_corner{8.0, 4.0};
constexpr double wall_x_m = 4.0;  // between the two rooms

PhaseReading exact_phases(const Pose2& a, const Pose2& b) {
  const Pose2 a_from_b = inverse(a) * b;
  const Pose2 b_from_a = inverse(b) * a;
  return {.turn_rad = a_from_b.heading_rad,
          .direction_a_rad = std::atan2(a_from_b.y_m, a_from_b.x_m),
          .direction_b_rad = std::atan2(b_from_a.y_m, b_from_a.x_m),
          .length = std::hypot(a_from_b.x_m, a_from_b.y_m),
          .has_direction = true};
}

/// Two rooms with one door, arranged in two pieces, each in a frame of its own.
struct TwoPieces {
  ToyWorld world;
  RememberedWorld remembered;
  Lattice lattice;
  std::vector<Lattice::Spring> through_door;

  explicit TwoPieces(std::uint64_t seed)
      : world(two_rooms(seed, false)),
        remembered(world, far_corner, crossing_spacing_m, seed),
        lattice() {
    const Pose2 other_frame{20.0, -5.0, 2.0};
    const auto is_right = [&](ViewId view) { return remembered.pose_of(view).x_m >= wall_x_m; };
    for (const ViewId view : remembered.memory.views()) {
      const Pose2& pose = remembered.pose_of(view);
      lattice.nodes.push_back({.view = view,
                               .pose = is_right(view) ? other_frame * pose : pose,
                               .component = is_right(view) ? 1U : 0U});
    }
    for (const Link& link : remembered.memory.links()) {
      const PhaseReading phases =
          exact_phases(remembered.pose_of(link.a), remembered.pose_of(link.b));
      (is_right(link.a) == is_right(link.b) ? lattice.springs : through_door)
          .push_back(
              {.a = link.a.value, .b = link.b.value, .length = phases.length, .phases = phases});
    }
  }

  /// Adds one crossing through the door. Its two directions are off, as those of weak evidence are;
  /// homing must do without them.
  void add_crossing(double off_rad) {
    const Lattice::Spring& spring = through_door.at(through_door.size() / 2);
    PhaseReading phases = *spring.phases;
    phases.direction_a_rad = wrap_angle(phases.direction_a_rad + off_rad);
    phases.direction_b_rad = wrap_angle(phases.direction_b_rad + off_rad);
    lattice.crossings.push_back({spring.a, spring.b, phases, 0.6});
  }
};

/// Drives until the navigator stops; returns its last decision, with the events of all.
NavigationDecision drive_to(Navigator& navigator, const TwoPieces& place, ViewId goal,
                            const Pose2& start, std::uint64_t seed, Pose2& end) {
  SimulatedRobot robot(place.world, start, DriveKind::differential, seed);
  Random noise(seed, 9);
  navigator.set_goal(goal);
  navigator.forget_place();
  std::vector<NavigationDecision::Event> events;
  NavigationDecision decision;
  RobotReport report;
  for (int step = 0; step < 600; ++step) {
    decision =
        navigator.observe(two_rooms_signature(place.world, robot.pose(), noise, 1.0), report);
    events.insert(events.end(), decision.events.begin(), decision.events.end());
    if (decision.state != NavigationDecision::State::moving) break;
    report.obstacle = robot.go(decision.direction_rad, decision.advance_m);
  }
  decision.events = events;
  end = robot.pose();
  return decision;
}

TEST(Crossing, LeadsARobotFromOnePieceOfAnArrangementIntoTheOther) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int runs = 0;
  int arrived = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    TwoPieces place(seed);
    ASSERT_FALSE(place.through_door.empty());
    const MemoryViewSource source(place.remembered.memory);
    Navigator apart(source, AreaPlanner(graph_from_lattice(place.lattice)));
    place.add_crossing(seed % 2 == 0 ? 1.0 : -1.0);
    Navigator joined(source, AreaPlanner(graph_from_lattice(place.lattice)));
    Random random(seed, 3);
    for (int i = 0; i < 4; ++i) {
      // In turn from either side, so that the crossing is used in both directions.
      const auto pick = [&](bool right) {
        for (;;) {
          const ViewId view{static_cast<std::uint32_t>(random.index(place.lattice.nodes.size()))};
          const double x_m = place.remembered.pose_of(view).x_m;
          if (right ? x_m > wall_x_m + 0.8 : x_m < wall_x_m - 0.8) return view;
        }
      };
      const Pose2 start = place.remembered.pose_of(pick(i % 2 == 1));
      const ViewId goal = pick(i % 2 == 0);
      const std::uint64_t noise = random.next();
      Pose2 end;
      const auto stopped = drive_to(apart, place, goal, start, noise, end);
      EXPECT_EQ(stopped.state, NavigationDecision::State::unreachable) << describe(stopped);

      const auto decision = drive_to(joined, place, goal, start, noise, end);
      ++runs;
      if (decision.state != NavigationDecision::State::arrived) continue;
      ++arrived;
      EXPECT_LE(distance(end.position(), place.remembered.pose_of(goal).position()),
                crossing_spacing_m);
      EXPECT_TRUE(std::ranges::count(decision.events, NavigationDecision::Event::crossing) > 0)
          << describe(decision);
    }
  }
  RecordProperty("arrived", arrived);
  EXPECT_GE(arrived, runs - 1);
}

}  // namespace
}  // namespace panonav::testing
