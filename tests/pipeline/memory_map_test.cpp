#include "panonav/pipeline/memory_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "support/mapped_room.hpp"

namespace panonav::testing {
namespace {

TEST_F(MemoryMaps, ViewsInOrderGetPositionsInViewSteps) {
  const auto truth = rounds(round_views + 40);
  MemoryFile memory = make_walk(truth);
  EXPECT_FALSE(has_positions_from_map(memory));
  EXPECT_EQ(read_length_unit(memory), LengthUnit::metres);
  std::size_t mapped = 0;
  const auto map = map_views(memory, {}, executor, [&] { ++mapped; });
  ASSERT_TRUE(map);
  EXPECT_EQ(mapped, truth.size());
  EXPECT_EQ(map->unit, LengthUnit::view_steps);
  EXPECT_EQ(map->part_sizes, std::vector<std::size_t>{truth.size()});
  EXPECT_TRUE(has_positions_from_map(memory));
  EXPECT_NEAR(median_step_length(memory.map(map_name).value()).value(), 1.0, 1e-9);
  EXPECT_LT(shape(memory, truth), 0.01);
  // Things are 4 m away and assumed to be 1.5 m away, so a step of 9 cm is taken for some 3.4 cm.
  EXPECT_NEAR(read_assumed_unit_m(memory), 0.0914 * 1.5 / radius_m, 0.012);
}

TEST_F(MemoryMaps, OdometryMakesMetresAndIsKeptWhenViewsFollow) {
  const auto truth = rounds(80);
  MemoryFile memory = make_walk(truth);
  std::map<std::string, Pose2> odometry;
  for (std::size_t i = 0; i < truth.size(); ++i) odometry[name_view(i)] = truth[i];
  EXPECT_EQ(map_views(memory, odometry, executor).value().unit, LengthUnit::metres);
  const auto distance_over = [&](std::size_t i, std::size_t j) {
    const auto points = positions(memory);
    return distance(points[i], points[j]);
  };
  const double expected_m = distance(truth[0].position(), truth[40].position());
  EXPECT_NEAR(distance_over(0, 40), expected_m, 0.02 * expected_m);
  const auto more = rounds(100);
  for (std::size_t i = 80; i < more.size(); ++i) {
    append(memory, round_room_signature(world, more[i]));
  }
  EXPECT_EQ(map_views(memory, {}, executor).value().unit, LengthUnit::metres);
  EXPECT_NEAR(distance_over(0, 40), expected_m, 0.02 * expected_m);
  const double later_m = distance(more[60].position(), more[95].position());
  EXPECT_NEAR(distance_over(60, 95), later_m, 0.1 * later_m);
}

TEST_F(MemoryMaps, ViewsInNoOrderAreArranged) {
  // Random places of the room: neighbours in the memory are not neighbours in the room.
  std::vector<Pose2> places;
  for (double x = -1.5; x <= 1.5; x += 0.25) {
    for (double y = -1.5; y <= 1.5; y += 0.25) places.push_back({x, y, 0.0});
  }
  std::mt19937 random(1);
  std::ranges::shuffle(places, random);
  MemoryFile memory = make_walk(places);
  const auto map = map_views(memory, {}, executor);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->unit, LengthUnit::view_steps);
  EXPECT_GE(map->part_sizes.front(), places.size() * 9 / 10);
  EXPECT_LT(shape(memory, places), 0.2);
}

TEST(MemoryMapUnits, CopiesOfViewsDoNotSetTheUnitOfAnArrangement) {
  // Springs without length hold copies together but for rounding.
  TopologicalMap map;
  for (std::uint32_t i = 0; i < 12; ++i) {
    const double rounding = 1e-17 * (i % 3);
    map.nodes.push_back({ViewId{i}, {0.5 * (i / 3) + rounding, -rounding, 0.0}, 0});
  }
  EXPECT_NEAR(compute_view_step(map).value(), 0.5, 1e-9);
}

/// True if `are_in_order` finds the order of views from these poses, with some noise.
bool order_is_visible(const ToyWorld& world, const std::vector<Pose2>& poses) {
  Random noise(4, 1);
  std::vector<FourierSignature> signatures;
  for (const Pose2& pose : poses) {
    signatures.push_back(compute_signature(
        world.panorama({pose.x_m + 0.002 * noise.normal(), pose.y_m, pose.heading_rad},
                       round_room_shape.rows, 96),
        round_room_shape.components));
  }
  return are_in_order(make_memory(
      signatures, std::vector<std::optional<ReferencePose>>(signatures.size(), std::nullopt)));
}

TEST_F(MemoryMaps, OrderIsThatOfAWalkAlsoWithStandingPartsAndGaps) {
  const auto walk = rounds(100);
  EXPECT_TRUE(order_is_visible(world, walk));
  std::vector<Pose2> slow;
  for (const Pose2& pose : rounds(40)) slow.insert(slow.end(), 5, pose);
  EXPECT_TRUE(order_is_visible(world, slow));
  std::vector<Pose2> standing(walk.begin(), walk.begin() + 40);
  standing.insert(standing.end(), 60, walk[40]);
  standing.insert(standing.end(), walk.begin() + 41, walk.begin() + 60);
  EXPECT_TRUE(order_is_visible(world, standing));
  std::vector<Pose2> two_walks(walk.begin() + 60, walk.end());
  two_walks.insert(two_walks.end(), walk.begin(), walk.begin() + 50);
  EXPECT_TRUE(order_is_visible(world, two_walks));
}

TEST_F(MemoryMaps, ShuffledAndHalfShuffledViewsAreInNoOrder) {
  int taken_for_a_walk = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const std::size_t count : {12U, 40U, 100U}) {
      auto poses = rounds(100);
      poses.resize(count);
      std::mt19937 random(seed);
      std::ranges::shuffle(poses, random);
      taken_for_a_walk += order_is_visible(world, poses) ? 1 : 0;
    }
    auto partly = rounds(100);
    std::mt19937 random(seed);
    std::shuffle(partly.begin(), partly.begin() + 60, random);
    taken_for_a_walk += order_is_visible(world, partly) ? 1 : 0;
  }
  EXPECT_EQ(taken_for_a_walk, 0);
}

bool has_sequence(const TopologicalMap& map, ViewId a, ViewId b) {
  return std::ranges::any_of(map.edges, [&](const auto& edge) {
    return edge.kind == Link::Kind::sequence && edge.a == a && edge.b == b;
  });
}

TEST_F(MemoryMaps, APathDoesNotFollowTheLastViewOfThePathBefore) {
  MemoryFile memory = make_walk(rounds(40));
  const std::vector<ViewId> views = memory.views();
  ASSERT_TRUE(map_views(memory, {}, executor));
  EXPECT_TRUE(has_sequence(memory.map(map_name).value(), views[19], views[20]));
  add_path_starts(memory, std::array{views[20]});
  add_path_starts(memory, std::array{views[10], views[20]});
  EXPECT_EQ(read_path_starts(memory), std::vector({views[10], views[20]}));
  ASSERT_TRUE(map_views(memory, {}, executor));
  EXPECT_FALSE(has_sequence(memory.map(map_name).value(), views[9], views[10]));
  EXPECT_FALSE(has_sequence(memory.map(map_name).value(), views[19], views[20]));
  EXPECT_TRUE(has_sequence(memory.map(map_name).value(), views[20], views[21]));
  memory.remove(std::array{views[20]});  // the next one begins the path
  ASSERT_TRUE(map_views(memory, {}, executor));
  EXPECT_FALSE(has_sequence(memory.map(map_name).value(), views[19], views[21]));
  for (const char* text : {"a", "12 -3", "1.5", "21 11", "11 11", "4294967296"}) {
    memory.set_parameter("path_starts", text);
    EXPECT_THROW(static_cast<void>(read_path_starts(memory)), FileError) << text;
  }
}

// Images in no order that were added to a walk: each is placed by the views around it.
TEST_F(MemoryMaps, ViewsInNoOrderJoinTheWalkBesideWhichTheyWereTaken) {
  const auto walk = rounds(60);
  for (const auto& [is_same_room, added] :
       {std::pair(true, 12), std::pair(true, 60), std::pair(false, 12), std::pair(false, 60)}) {
    SCOPED_TRACE(std::to_string(is_same_room) + " " + std::to_string(added));
    MemoryFile memory = make_walk(walk);
    std::vector<Pose2> all = walk;
    const ToyWorld other = round_room(radius_m, 77);
    for (int i = 0; i < added; ++i) {
      const Pose2& near = walk[static_cast<std::size_t>(i * 23 % 60)];
      all.push_back({0.97 * near.x_m, 0.97 * near.y_m, wrap_angle(1.7 * i)});
      append(memory, round_room_signature(is_same_room ? world : other, all.back()));
    }
    add_path_starts(memory, std::array{memory.views()[60]});
    const auto map = map_views(memory, {}, executor);
    ASSERT_TRUE(map);
    if (!is_same_room) {
      EXPECT_EQ(map->part_sizes.front(), 60U) << "the room looks otherwise";
      continue;
    }
    ASSERT_EQ(map->part_sizes,
              std::vector<std::size_t>{walk.size() + static_cast<std::size_t>(added)});
    const auto found = positions(memory);
    std::vector<Point2> truth;
    for (const Pose2& pose : all) truth.push_back(pose.position());
    EXPECT_LT(shape_difference(found, truth).value, 0.01);
  }
}

TEST_F(MemoryMaps, PartsWithoutConnectionAreBesideEachOther) {
  const auto truth = rounds(60);
  MemoryFile memory = make_memory();
  for (std::size_t i = 0; i < 40; ++i) append(memory, round_room_signature(world, truth[i]));
  for (int i = 0; i < 5; ++i) append(memory, empty_view());
  const ToyWorld other = round_room(radius_m, 77);
  for (std::size_t i = 0; i < 20; ++i) append(memory, round_room_signature(other, truth[i]));
  const auto map = map_views(memory, {}, executor);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->part_sizes, (std::vector<std::size_t>{40, 20, 1, 1, 1, 1, 1}));
  const VisualMemory views = memory.load();
  const auto stored = memory.map(map_name).value();
  const auto pose_of = [&](std::size_t i) { return views.info(stored.nodes[i].view).pose; };
  for (std::size_t i = 0; i < stored.nodes.size(); ++i) {
    EXPECT_EQ(pose_of(i).has_value(), i < 40 || i >= 45) << "small parts have no positions";
    for (std::size_t j = 0; j < i; ++j) {
      if (stored.nodes[i].component == stored.nodes[j].component) continue;
      if (!pose_of(i) || !pose_of(j)) continue;
      EXPECT_GE(distance(pose_of(i)->position(), pose_of(j)->position()), 5.99) << i << " " << j;
    }
  }
}

TEST_F(MemoryMaps, PlacesComponentsWithoutOverlapAndKeepsTheLargest) {
  TopologicalMap map;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-9.0, 9.0);
  for (std::uint32_t i = 0; i < 60; ++i) {
    const std::size_t component = i < 20 ? 2 : i % 7;
    map.nodes.push_back({ViewId{i + 1}, {anywhere(random), anywhere(random), 0.3}, component});
  }
  constexpr double gap = 2.5;
  const auto poses = place_components_side_by_side(map, gap);
  ASSERT_EQ(poses.size(), map.nodes.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (map.nodes[i].component == 2) {
      EXPECT_EQ(poses[i], map.nodes[i].pose);
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double moved = distance(poses[i].position(), poses[j].position());
      if (map.nodes[i].component == map.nodes[j].component) {
        EXPECT_NEAR(moved, distance(map.nodes[i].pose.position(), map.nodes[j].pose.position()),
                    1e-9);
      } else {
        EXPECT_GE(moved, gap - 1e-9);
      }
    }
  }
  EXPECT_TRUE(place_components_side_by_side({}, gap).empty());
}

TEST_F(MemoryMaps, PositionsOfADataSetAreKeptAndReplaceThoseOfAMap) {
  const auto truth = rounds(30);
  MemoryFile posed = make_memory();
  for (const Pose2& pose : truth) {
    append(posed, round_room_signature(world, pose),
           ReferencePose{pose.x_m, pose.y_m, pose.heading_rad});
  }
  EXPECT_FALSE(map_views(posed, {}, executor));
  EXPECT_NEAR(shape(posed, truth), 0.0, 1e-12);
  EXPECT_THROW(scale_to_metres(posed, posed.views()[0], posed.views()[9], 1.0, "s"), ContractError);
  remove_positions_from_map(posed);
  EXPECT_EQ(posed.info().views_with_position, truth.size());
  MemoryFile mapped = make_walk(truth);
  ASSERT_TRUE(map_views(mapped, {}, executor));
  remove_positions_from_map(mapped);
  EXPECT_EQ(mapped.info().views_with_position, 0U);
  EXPECT_EQ(mapped.info().links, 0U);
  EXPECT_FALSE(has_positions_from_map(mapped));
  EXPECT_FALSE(describe_map(mapped));
}

TEST_F(MemoryMaps, RefusesAnUnknownUnit) {
  MemoryFile memory = make_walk(rounds(3));
  for (const char* text : {"inches", "view_steps", "view_steps x", "view_steps -1"}) {
    memory.set_parameter("map_unit", text);
    EXPECT_THROW(static_cast<void>(read_length_unit(memory)), FileError) << text;
  }
}

}  // namespace
}  // namespace panonav::testing
