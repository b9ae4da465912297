#include "panonav/mapping/session_alignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

constexpr int views_in_round = 110;

// A round of 10 m, looking ahead, with a view every 9 cm.
std::vector<Pose2> drive(int first, int views, double round_radius_m) {
  std::vector<Pose2> poses;
  for (int i = first; i < first + views; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / views_in_round;
    poses.push_back(
        {round_radius_m * std::sin(angle), -round_radius_m * std::cos(angle), wrap_angle(angle)});
  }
  return poses;
}

/// Views in one memory, and a map of each session in the frame of its first view.
struct Sessions {
  VisualMemory memory{round_room_shape, 0.1F, std::nullopt};

  TopologicalMap add(const ToyWorld& world, const std::vector<Pose2>& truth) {
    TopologicalMap map;
    for (const Pose2& pose : truth) {
      const ViewId view =
          memory.append(round_room_signature(world, pose), {.name = std::to_string(memory.size())});
      const Pose2 here = inverse(truth.front()) * pose;
      if (!map.nodes.empty()) {
        const TopologicalMap::Node& before = map.nodes.back();
        map.edges.push_back({before.view, view, inverse(before.pose) * here});
      }
      map.nodes.push_back({view, here, 0});
    }
    return map;
  }
};

void expect_near(const Pose2& found, const Pose2& truth, double within_m, double within_rad) {
  const Pose2 error = inverse(truth) * found;
  EXPECT_LT(std::hypot(error.x_m, error.y_m), within_m);
  EXPECT_LT(std::abs(error.heading_rad), within_rad);
}

TEST(AlignSessions, FindsHowTwoDrivesInOneRoomLieAndJoinsTheirMaps) {
  const ToyWorld world = round_room(round_room_radius_m, 5);
  const auto first_truth = drive(0, 110, 1.6);
  const auto second_truth = drive(40, 110, 1.7);
  Sessions sessions;
  const TopologicalMap first = sessions.add(world, first_truth);
  const TopologicalMap second = sessions.add(world, second_truth);
  const auto found = align_sessions(sessions.memory, first, second);
  ASSERT_TRUE(found);
  EXPECT_GE(found->places, 10);
  EXPECT_GT(found->expected_places, 10);
  EXPECT_GE(found->confirmed_places, found->expected_places * 7 / 10);
  const Pose2 truth = inverse(first_truth.front()) * second_truth.front();
  expect_near(found->first_from_second, truth, 0.3, 0.1);
  for (const LoopClosure& match : found->matches) {
    expect_near(match.earlier_from_later,
                inverse(first_truth.at(match.earlier)) * second_truth.at(match.later), 0.6, 0.15);
  }
  const auto back = align_sessions(sessions.memory, second, first);
  ASSERT_TRUE(back);
  expect_near(back->first_from_second, inverse(truth), 0.3, 0.1);

  const TopologicalMap joined = join_sessions(first, second, *found);
  validate(joined);
  EXPECT_EQ(joined.nodes.size(), first.nodes.size() + second.nodes.size());
  EXPECT_EQ(count_components(joined), 1U);
  double worst_m = 0.0;
  for (std::size_t i = 0; i < joined.nodes.size(); ++i) {
    const Pose2& pose =
        i < first_truth.size() ? first_truth[i] : second_truth[i - first_truth.size()];
    const Point2 here = (inverse(first_truth.front()) * pose).position();
    worst_m = std::max(worst_m, distance(joined.nodes[i].pose.position(), here));
  }
  EXPECT_LT(worst_m, 0.4);
}

TEST(AlignSessions, AnotherRoomHasNoPlaceInCommon) {
  for (const std::uint64_t seed : {6, 7, 8, 9}) {
    Sessions sessions;
    const TopologicalMap first =
        sessions.add(round_room(round_room_radius_m, 5), drive(0, 110, 1.6));
    const TopologicalMap second =
        sessions.add(round_room(round_room_radius_m, seed), drive(0, 110, 1.6));
    EXPECT_FALSE(align_sessions(sessions.memory, first, second)) << seed;
  }
}

TEST(AlignSessions, ViewsOfBothSessionsArePlacesInCommon) {
  Sessions sessions;
  const TopologicalMap first = sessions.add(round_room(round_room_radius_m, 5), drive(0, 110, 1.6));
  TopologicalMap second = first;
  const Pose2 moved{3.0, -1.0, 2.0};
  for (TopologicalMap::Node& node : second.nodes) node.pose = moved * node.pose;
  const auto found = align_sessions(sessions.memory, first, second);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->matches.size(), first.nodes.size());
  EXPECT_EQ(found->confirmed_places, found->expected_places);
  expect_near(found->first_from_second, inverse(moved), 1e-9, 1e-9);
  const TopologicalMap joined = join_sessions(first, second, *found);
  EXPECT_EQ(joined.nodes.size(), first.nodes.size());
}

TEST(AlignSessions, NothingIsAlignedWithNothing) {
  Sessions sessions;
  const TopologicalMap first = sessions.add(round_room(round_room_radius_m, 5), drive(0, 20, 1.6));
  EXPECT_FALSE(align_sessions(sessions.memory, first, {}));
  EXPECT_FALSE(align_sessions(sessions.memory, {}, first));
  TopologicalMap foreign = first;
  foreign.nodes.back().view = ViewId{999};
  foreign.edges.clear();
  EXPECT_THROW((void)align_sessions(sessions.memory, first, foreign), ContractError);
  EXPECT_THROW((void)align_sessions(sessions.memory, first, first, {.min_confirmed = 1.5}),
               OptionError);
}

}  // namespace
}  // namespace panonav::testing
