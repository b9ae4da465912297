#include "panonav/mapping/sparse_memory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

enum class Known { positions, links };

// A straight way with a view every 2 cm, at random headings.
VisualMemory along_a_line(const ToyWorld& room, int views, Known known) {
  VisualMemory memory = empty_round_room_memory();
  Random random(3);
  std::optional<ViewId> before;
  for (int i = 0; i < views; ++i) {
    const Pose2 pose{-1.0 + 0.02 * i, 0.3, random.uniform(-3.0, 3.0)};
    ReferenceInfo info{.name = std::to_string(i)};
    if (known == Known::positions) info.pose = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
    const ViewId view = memory.append(round_room_signature(room, pose), info);
    if (before && known == Known::links) memory.link({*before, view, Link::Kind::sequence});
    before = view;
  }
  return memory;
}

double difference_of(const VisualMemory& memory, ViewId a, ViewId b) {
  return image_difference(homing_view(memory.signature(a)), homing_view(memory.signature(b)));
}

TEST(SparseMemory, EveryDroppedViewHasOneThatStandsForIt) {
  const ToyWorld room = round_room(round_room_radius_m, 1);
  for (const Known known : {Known::positions, Known::links}) {
    const auto memory = along_a_line(room, 100, known);
    const SparseMemoryOptions options{.max_difference = 0.05};
    const auto selection = select_references(memory, options);
    EXPECT_EQ(selection.kept.size() + selection.redundant.size(), memory.size());
    EXPECT_GE(selection.kept.size(), 3U);
    EXPECT_LE(selection.kept.size(), 40U);
    const std::set<ViewId> kept(selection.kept.begin(), selection.kept.end());
    for (const SparseSelection::Redundant& redundant : selection.redundant) {
      EXPECT_FALSE(kept.contains(redundant.view));
      EXPECT_TRUE(kept.contains(redundant.kept));
      EXPECT_LE(difference_of(memory, redundant.kept, redundant.view), options.max_difference);
      EXPECT_FALSE(redundant.outdated);
    }
    EXPECT_EQ(select_references(memory, options), selection);
  }
}

TEST(SparseMemory, MoreLossKeepsLess) {
  const auto memory = along_a_line(round_room(round_room_radius_m, 2), 100, Known::positions);
  std::size_t before = memory.size() + 1;
  double loss_before = -1.0;
  for (const double difference : {0.0, 0.02, 0.08, 0.3}) {
    const auto selection = select_references(memory, {.max_difference = difference});
    const auto loss = measure_loss(memory, selection);
    EXPECT_LT(selection.kept.size(), before);
    EXPECT_GE(loss.median_difference, loss_before);
    before = selection.kept.size();
    loss_before = std::max(0.0, loss.median_difference);
    if (difference == 0.3) {
      ASSERT_TRUE(loss.positions.has_value());
      EXPECT_GT(loss.positions->median_after_m, loss.positions->median_before_m);
      EXPECT_LT(loss.positions->p95_after_m, 1.0);
    }
  }
}

TEST(SparseMemory, FarPlacesThatLookAlikeAreKept) {
  const ToyWorld room = round_room(round_room_radius_m, 3);
  VisualMemory memory = empty_round_room_memory();
  const auto view = round_room_signature(room, {});
  memory.append(view, {.name = "here", .pose = ReferencePose{0.0, 0.0, {}}});
  memory.append(view, {.name = "there", .pose = ReferencePose{5.0, 0.0, {}}});
  memory.append(view, {.name = "here again", .pose = ReferencePose{0.1, 0.0, {}}});
  const auto selection = select_references(memory);
  EXPECT_EQ(selection.kept.size(), 2U);
  EXPECT_EQ(memory.info(selection.redundant.at(0).view).name, "here");  // the older one
}

TEST(SparseMemory, NewerViewsReplaceOutdatedOnes) {
  const ToyWorld before = round_room(round_room_radius_m, 4);
  const ToyWorld after = round_room(round_room_radius_m, 5);  // everything looks different now
  VisualMemory memory = empty_round_room_memory();
  for (int i = 0; i < 5; ++i) {
    const Pose2 pose{0.5 * i, 0.0, 0.0};
    memory.append(round_room_signature(before, pose),
                  {.name = "old " + std::to_string(i), .pose = ReferencePose{pose.x_m, 0.0, {}}});
  }
  for (int i = 0; i < 3; ++i) {
    const Pose2 pose{0.5 * i + 0.05, 0.0, 0.0};
    memory.append(round_room_signature(after, pose),
                  {.name = "new " + std::to_string(i), .pose = ReferencePose{pose.x_m, 0.0, {}}});
  }
  EXPECT_EQ(select_references(memory, {.max_difference = 0.01}).kept.size(), 8U);
  const auto selection =
      select_references(memory, {.max_difference = 0.01, .outdated_within_m = 0.1});
  ASSERT_EQ(selection.redundant.size(), 3U);
  for (const SparseSelection::Redundant& redundant : selection.redundant) {
    EXPECT_TRUE(redundant.outdated);
    EXPECT_EQ(memory.info(redundant.view).name.substr(0, 3), "old");
    EXPECT_EQ(memory.info(redundant.kept).name.substr(0, 3), "new");
  }
}

TEST(SparseMemory, WhatWasConnectedStaysConnected) {
  const auto memory = along_a_line(round_room(round_room_radius_m, 7), 60, Known::links);
  const auto selection = select_references(memory, {.max_difference = 0.1});
  ASSERT_GT(selection.redundant.size(), 20U);
  TopologicalMap map;
  for (const ViewId view : memory.views()) {
    const auto i = static_cast<double>(map.nodes.size());
    if (!map.nodes.empty()) map.edges.push_back({map.nodes.back().view, view, {0.02, 0.0, 0.0}});
    map.nodes.push_back({view, {0.02 * i, 0.0, 0.0}, 0});
  }
  const auto left = contract_map(map, selection);
  EXPECT_NO_THROW(validate(left));
  ASSERT_EQ(left.nodes.size(), selection.kept.size());
  EXPECT_EQ(left.edges.size(), contract_links(memory.links(), selection).size());
  const auto number = [&](ViewId view) {
    return static_cast<std::size_t>(std::ranges::find(selection.kept, view) -
                                    selection.kept.begin());
  };
  std::vector<PoseEdge> edges;
  for (const TopologicalMap::Edge& edge : left.edges) {
    edges.push_back({number(edge.a), number(edge.b), edge.a_from_b});
    const Pose2 a = left.nodes[number(edge.a)].pose;
    EXPECT_NEAR((a * edge.a_from_b).x_m, left.nodes[number(edge.b)].pose.x_m, 1e-9);
  }
  for (const std::size_t component : connected_components(left.nodes.size(), edges))
    EXPECT_EQ(component, 0U);
  EXPECT_EQ(contract_map(map, {.kept = {}, .redundant = {}}), map);
}

TEST(SparseMemory, DegenerateMemories) {
  VisualMemory memory = empty_round_room_memory();
  EXPECT_TRUE(select_references(memory).kept.empty());
  EXPECT_EQ(measure_loss(memory, {}).queries, 0U);
  const ToyWorld room = round_room(round_room_radius_m, 6);
  const auto view = round_room_signature(room, {});
  memory.append(view, {.name = "one"});
  EXPECT_EQ(select_references(memory).kept.size(), 1U);
  memory.append(view, {.name = "the same, unlinked"});
  EXPECT_EQ(select_references(memory).kept.size(), 2U);
  memory.link({memory.views()[0], memory.views()[1], Link::Kind::sequence});
  const auto selection = select_references(memory);
  EXPECT_EQ(selection.kept.size(), 1U);
  EXPECT_FALSE(measure_loss(memory, selection).positions.has_value());
  EXPECT_THROW((void)select_references(memory, {.max_difference = -1.0}), OptionError);
  EXPECT_THROW((void)select_references(memory, {.reach_m = 0.0}), OptionError);
  EXPECT_THROW((void)measure_loss(memory, selection, 0), ContractError);
}

}  // namespace
}  // namespace panonav::testing
