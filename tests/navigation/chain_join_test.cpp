#include "panonav/navigation/chain_join.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/homing/chain_recorder.hpp"
#include "panonav/motion/steering.hpp"
#include "panonav/navigation/navigator.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

// Two rooms whose door no reference shows: only a chain, recorded on a drive, leads through it.
struct TwoIslands {
  ToyWorld world;
  RememberedWorld remembered;
  SnapshotChain chain;
  std::vector<Pose2> places;  // of the snapshots

  explicit TwoIslands(std::uint64_t seed)
      : world(two_rooms(seed, false)), remembered(world, {8.0, 4.0}, 0.3, seed) {
    const std::vector<ViewId> views(remembered.memory.views().begin(),
                                    remembered.memory.views().end());
    for (const ViewId view : views) {
      if (std::abs(remembered.pose_of(view).x_m - 4.0) < 1.0) remembered.memory.remove(view);
    }
    record(seed);
  }

 private:
  void record(std::uint64_t seed) {
    const std::vector<Point2> path{{2.6, 2.8}, {4.0, 2.8}, {5.4, 3.2}};
    PathFollower follower(path);
    ChainRecorder recorder;
    Random noise(seed, 11);
    OdometryNoise odometry;
    Pose2 robot{2.6, 2.8, 0.0};
    std::vector<Pose2> driven{robot};
    recorder.add(homing_view(two_rooms_signature(world, robot, noise)), {});
    Pose2 moved;
    while (const auto step = follower.next_step(robot)) {
      robot = robot * *step;
      moved = moved * sample_step(*step, odometry, noise);
      if (std::hypot(moved.x_m, moved.y_m) < 0.1) continue;
      recorder.add(homing_view(two_rooms_signature(world, robot, noise)), moved);
      driven.push_back(robot);
      moved = {};
    }
    chain = recorder.finish();
    for (const Snapshot& snapshot : chain.snapshots) {
      // The chain tells the way alone; where that was on the drive is for the test.
      double way_m = 0.0;
      std::size_t i = 0;
      while (i + 1 < driven.size() && way_m < snapshot.travelled_m - 0.06) {
        way_m += distance(driven[i].position(), driven[i + 1].position());
        ++i;
      }
      places.push_back(driven[i]);
    }
  }
};

TEST(ChainJoin, PlansLeadOverAChain) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  int runs = 0;
  int arrived = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    TwoIslands islands(seed);
    VisualMemory& memory = islands.remembered.memory;
    Executor executor(1);
    std::vector<ViewId> left;
    std::vector<ViewId> right;
    for (const ViewId view : memory.views()) {
      (islands.remembered.pose_of(view).x_m < 4.0 ? left : right).push_back(view);
    }
    const NavigationGraph before = graph_of_memory(memory, executor);
    ASSERT_FALSE(direction_field(before, right[0])[*before.node_of(left[0])].reachable());

    const JoinedChain joined = join_chain(memory, islands.chain, "through the door");
    ASSERT_EQ(joined.views.size(), islands.chain.snapshots.size());
    ASSERT_GE(joined.views.size(), 3U);
    const auto place_of = [&](ViewId view) {
      const auto snapshot = std::ranges::find(joined.views, view);
      return snapshot == joined.views.end()
                 ? islands.remembered.pose_of(view)
                 : islands.places[static_cast<std::size_t>(snapshot - joined.views.begin())];
    };
    for (const Link& link : joined.links) {
      if (link.kind != LinkKind::closure) continue;
      const double apart_m = distance(place_of(link.a).position(), place_of(link.b).position());
      EXPECT_LT(apart_m, 1.0) << "a link of places that lie apart";
    }
    const NavigationGraph graph = graph_of_memory(memory, executor, joined.motion);
    AreaPlanner planner(graph, {.areas = {.views_per_area = 60}});
    const MemoryViewSource source(memory);
    Navigator navigator(source, planner);
    Random random(seed, 12);
    for (int i = 0; i < 4; ++i) {
      // To and fro.
      const auto& from = i % 2 == 0 ? left : right;
      const auto& to = i % 2 == 0 ? right : left;
      const ViewId start = from[random.index(from.size())];
      const ViewId goal = to[random.index(to.size())];
      planner.set_goal(goal);
      const auto way = planner.planned_way(*graph.node_of(start));
      ASSERT_FALSE(way.empty());
      const auto over = std::ranges::count_if(way, [&](std::size_t node) {
        return std::ranges::find(joined.views, graph.view(node)) != joined.views.end();
      });
      EXPECT_GE(over, 2) << "the plan does not lead over the chain";

      Pose2 pose = islands.remembered.pose_of(start);
      pose.heading_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
      SimulatedRobot robot(islands.world, pose, DriveKind::differential, random.next());
      Random noise(random.next());
      navigator.set_goal(goal);
      navigator.forget_place();
      RobotReport report;
      NavigationDecision decision;
      for (int look = 0; look < 300; ++look) {
        decision =
            navigator.observe(two_rooms_signature(islands.world, robot.pose(), noise), report);
        if (decision.state != NavigationState::moving) break;
        report.obstacle = robot.go(decision.direction_rad, decision.advance_m);
      }
      ++runs;
      arrived += decision.state == NavigationState::arrived &&
                 distance(robot.pose().position(), place_of(goal).position()) <= 0.15;
    }
  }
  RecordProperty("arrived", arrived);
  EXPECT_GE(arrived, runs * 9 / 10);
}

TEST(ChainJoin, KeepsTheSnapshotsAndTheirOrder) {
  TwoIslands islands(1);
  VisualMemory& memory = islands.remembered.memory;
  const std::size_t views = memory.size();
  const std::size_t links = memory.links().size();
  const JoinedChain joined = join_chain(memory, islands.chain, "route");
  EXPECT_EQ(memory.size(), views + islands.chain.snapshots.size());
  EXPECT_EQ(memory.links().size(), links + joined.links.size());
  ASSERT_EQ(joined.motion.size() + 1, joined.views.size());
  for (std::size_t i = 0; i < joined.views.size(); ++i) {
    EXPECT_EQ(memory.find("route/" + std::to_string(i)), joined.views[i]);
    const HomingView& wanted = islands.chain.snapshots[i].view;
    const HomingView kept = homing_view(memory.signature(joined.views[i]));
    // Bytes hold magnitudes to a 510th of the full scale and phases to half a step of 256.
    const double most = memory.full_scale() * (1.0 / 510.0 + std::numbers::pi / 256.0) + 1e-6;
    for (int k = 0; k < wanted.components(); ++k) {
      for (int row = 0; row < wanted.rows(); ++row) {
        EXPECT_NEAR(kept.a(row, k), wanted.a(row, k), most);
        EXPECT_NEAR(kept.b(row, k), wanted.b(row, k), most);
      }
    }
    if (i == 0) continue;
    EXPECT_EQ(joined.motion[i - 1].from, joined.views[i - 1]);
    EXPECT_EQ(joined.motion[i - 1].to, joined.views[i]);
    EXPECT_EQ(joined.motion[i - 1].step, islands.chain.snapshots[i].previous_from_this);
  }
}

TEST(ChainJoin, RefusesWhatDoesNotFitAndChangesNothing) {
  TwoIslands islands(1);
  VisualMemory& memory = islands.remembered.memory;
  static_cast<void>(join_chain(memory, islands.chain, "route"));
  const std::size_t views = memory.size();
  SnapshotChain few = islands.chain;
  for (Snapshot& snapshot : few.snapshots) snapshot.view = first_components(snapshot.view, 5);
  EXPECT_THROW((void)join_chain(memory, few, "few"), ContractError);
  EXPECT_THROW((void)join_chain(memory, {}, "none"), ContractError);
  EXPECT_THROW((void)join_chain(memory, islands.chain, ""), ContractError);
  EXPECT_THROW((void)join_chain(memory, islands.chain, "route"), ContractError);
  EXPECT_THROW((void)join_chain(memory, islands.chain, "other", {.candidates = 0}), OptionError);
  EXPECT_EQ(memory.size(), views);
}

}  // namespace
}  // namespace panonav::testing
