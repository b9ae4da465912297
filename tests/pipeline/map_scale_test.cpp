#include "panonav/pipeline/map_scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/route/route_panorama.hpp"
#include "support/mapped_room.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

TEST_F(MemoryMaps, AKnownDistanceMakesMetres) {
  const auto truth = rounds(round_views);
  MemoryFile memory = make_walk(truth);
  ASSERT_TRUE(map_views(memory, {}, executor));
  const auto before = positions(memory);
  RoutePanorama route(16);
  const std::vector<float> line(16, 0.5F);
  route.append({0.0, 0.0, 0.0}, line);
  route.append({2.0, 0.0, 0.0}, line);
  memory.append_route("walk", route);
  store_route_source(memory, "walk",
                     {.line = {.columns = 16}, .assumed_unit_m = read_assumed_unit_m(memory)});
  memory.append_route("metric", route);
  const auto views = memory.views();
  const double factor = scale_to_metres(memory, views[3], views[50], 3.0, "scale");
  const auto after = positions(memory);
  EXPECT_NEAR(distance(after[3], after[50]), 3.0, 1e-9);
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_NEAR(after[i].x_m, factor * before[i].x_m, 1e-9);
  EXPECT_EQ(read_length_unit(memory), LengthUnit::metres);
  EXPECT_NEAR(memory.route("walk")->length_m(), 2.0 * factor, 1e-9);
  EXPECT_FALSE(read_route_source(memory, "walk", 16).assumed_unit_m);
  EXPECT_EQ(memory.route("metric")->length_m(), 2.0);
  memory.undo();
  EXPECT_EQ(positions(memory), before);
  EXPECT_EQ(read_length_unit(memory), LengthUnit::view_steps);
  EXPECT_EQ(memory.route("walk")->length_m(), 2.0);
}

TEST_F(MemoryMaps, EveryScalingMovesTheRoutesInTheUnitOfTheMap) {
  MemoryFile memory = make_walk(rounds(round_views));
  ASSERT_TRUE(map_views(memory, {}, executor));
  const auto before = positions(memory);
  const double unit_m = read_assumed_unit_m(memory);
  append_route(memory, "along the map", unit_m);
  append_route(memory, "in longer steps", 2.5 * unit_m);
  append_route(memory, "by wheels", std::nullopt);
  const auto expect_scale = [&](double factor) {
    const auto now = positions(memory);
    for (std::size_t i = 0; i < now.size(); ++i)
      EXPECT_NEAR(now[i].x_m, factor * before[i].x_m, 1e-9);
    EXPECT_NEAR(memory.route("along the map")->length_m(), 2.0 * factor, 1e-9);
    EXPECT_EQ(memory.route("by wheels")->length_m(), 2.0);
  };
  scale_to_metres(memory, 0.4, "first");
  expect_scale(0.4);
  EXPECT_NEAR(memory.route("in longer steps")->length_m(), 2.0 * 0.4 * 2.5, 1e-9);
  EXPECT_TRUE(read_route_source(memory, "along the map", 16).is_in_map_unit);
  scale_to_metres(memory, 1.5, "correction");
  expect_scale(0.6);
  EXPECT_NEAR(memory.route("in longer steps")->length_m(), 2.0 * 0.6 * 2.5, 1e-9);
  memory.undo();
  expect_scale(0.4);
  EXPECT_EQ(read_length_unit(memory), LengthUnit::metres);
  memory.undo();
  expect_scale(1.0);
  EXPECT_EQ(read_length_unit(memory), LengthUnit::view_steps);
  EXPECT_EQ(read_route_source(memory, "along the map", 16).assumed_unit_m, unit_m);
  EXPECT_THROW(scale_to_metres(memory, 0.0, "s"), ContractError);
}

// A route in metres of a scaling that was undone gets the scale of the next one, not both.
TEST_F(MemoryMaps, RoutesOfAnUndoneScalingAreScaledOnce) {
  MemoryFile memory = make_walk(rounds(round_views));
  ASSERT_TRUE(map_views(memory, {}, executor));
  append_route(memory, "before", read_assumed_unit_m(memory), true);
  EXPECT_FALSE(read_map_scale(memory));
  scale_to_metres(memory, 0.4, "first");
  append_route(memory, "after", std::nullopt, true);
  memory.undo();
  append_route(memory, "of unknown scale", std::nullopt, true);
  EXPECT_EQ(memory.route("before")->length_m(), 2.0);
  EXPECT_EQ(memory.route("after")->length_m(), 2.0);
  scale_to_metres(memory, 0.6, "second");
  EXPECT_NEAR(memory.route("before")->length_m(), 2.0 * 0.6, 1e-9);
  EXPECT_NEAR(memory.route("after")->length_m(), 2.0 * 0.6 / 0.4, 1e-9);
  EXPECT_EQ(memory.route("of unknown scale")->length_m(), 2.0) << "no scale of its metres is known";
  EXPECT_EQ(read_route_source(memory, "after", 16).map_scale, read_map_scale(memory));
  // The same for a correction in metres that was undone.
  scale_to_metres(memory, 2.0, "correction");
  append_route(memory, "late", std::nullopt, true);
  EXPECT_NEAR(memory.route("after")->length_m(), 2.0 * 1.2 / 0.4, 1e-9);
  memory.undo();
  EXPECT_NEAR(memory.route("after")->length_m(), 2.0 * 0.6 / 0.4, 1e-9);
  scale_to_metres(memory, 1.5, "other correction");
  EXPECT_NEAR(memory.route("before")->length_m(), 2.0 * 0.9, 1e-9);
  EXPECT_NEAR(memory.route("after")->length_m(), 2.0 * 0.9 / 0.4, 1e-9);
  EXPECT_NEAR(memory.route("late")->length_m(), 2.0 * 0.9 / 1.2, 1e-9);
  memory.set_parameter("map_scale", "-1");
  EXPECT_THROW(static_cast<void>(read_map_scale(memory)), FileError);
}

TEST_F(MemoryMaps, AMapThatReplacesOneInMetresKeepsItsScale) {
  MemoryFile memory = make_walk(rounds(round_views));
  ASSERT_TRUE(map_views(memory, {}, executor));
  scale_to_metres(memory, 0.4, "scale");
  const auto before = positions(memory);
  append(memory, round_room_signature(world, {}), ReferencePose{0.3, 0.2, 0.1});  // of an update
  TopologicalMap map = memory.map(map_name).value();
  scale_lengths(map, 7.0);
  store_map(memory, map, LengthUnit::view_steps);
  EXPECT_EQ(read_length_unit(memory), LengthUnit::metres);
  const VisualMemory views = memory.load();
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto pose = views.info(map.nodes[i].view).pose;
    ASSERT_TRUE(pose);
    EXPECT_NEAR(pose->x_m, before[i].x_m, 1e-9);
    EXPECT_NEAR(pose->y_m, before[i].y_m, 1e-9);
  }
  EXPECT_FALSE(views.info(memory.views().back()).pose) << "in the frame of the earlier map";
}

TEST_F(MemoryMaps, AnArrangementKeepsItsScaleWhenViewsFollow) {
  std::vector<Pose2> places;
  for (double x = -1.5; x <= 1.5; x += 0.25) {
    for (double y = -1.5; y <= 1.5; y += 0.25) places.push_back({x, y, 0.0});
  }
  std::mt19937 random(1);
  std::ranges::shuffle(places, random);
  MemoryFile memory = make_walk({places.begin(), places.end() - 5});
  const auto described = map_views(memory, {}, executor);
  ASSERT_TRUE(described);
  EXPECT_STREQ(described->view_step, "median distance between a view and the nearest one");
  // Neighbours are too near for a scale here, too, and the limit is in the unit of the map.
  const TopologicalMap arranged = memory.map(map_name).value();
  const double step = compute_view_step(arranged).value();
  EXPECT_NEAR(step, 1.0, 0.05);
  const auto from_first = [&](const TopologicalMap::Node& node) {
    return distance(node.pose.position(), arranged.nodes.front().pose.position());
  };
  for (const TopologicalMap::Node& node : std::span(arranged.nodes).subspan(1)) {
    if (from_first(node) >= 3.0 * step) continue;
    const auto message = message_of<ContractError>(
        [&] { scale_to_metres(memory, arranged.nodes.front().view, node.view, 1.0, "s"); });
    EXPECT_TRUE(contains(message, "3 times the median distance between a view and the nearest"));
    EXPECT_TRUE(contains(message, "view steps apart"));
  }
  scale_to_metres(memory, 0.25, "scale");
  EXPECT_TRUE(contains(message_of<ContractError>([&] {
                         scale_to_metres(memory, memory.views()[0], memory.views()[0], 1.0, "s");
                       }),
                       " 0 m apart"));
  const TopologicalMap before = memory.map(map_name).value();
  for (auto place = places.end() - 5; place != places.end(); ++place)
    append(memory, round_room_signature(world, *place));
  EXPECT_EQ(map_views(memory, {}, executor).value().unit, LengthUnit::metres);
  EXPECT_NEAR(compare_lengths(before, memory.map(map_name).value()).value(), 1.0, 1e-9);
}

TEST_F(MemoryMaps, RoutesInViewStepsFollowAMapThatGetsMetresFromOdometry) {
  const auto truth = rounds(80);
  MemoryFile memory = make_walk(truth);
  ASSERT_TRUE(map_views(memory, {}, executor));
  append_route(memory, "walk", read_assumed_unit_m(memory));
  const TopologicalMap before = memory.map(map_name).value();
  std::map<std::string, Pose2> odometry;
  for (std::size_t i = 0; i < truth.size(); ++i) odometry[name_view(i)] = truth[i];
  EXPECT_EQ(map_views(memory, odometry, executor).value().unit, LengthUnit::metres);
  const double unit_m = compare_lengths(before, memory.map(map_name).value()).value();
  EXPECT_NEAR(unit_m, 0.0914, 0.01) << "a view step";
  EXPECT_NEAR(memory.route("walk")->length_m(), 2.0 * unit_m, 1e-9);
  EXPECT_FALSE(read_route_source(memory, "walk", 16).assumed_unit_m);
  append_route(memory, "in steps of its own", 0.3);
  for (auto& [name, pose] : odometry) pose = {2.0 * pose.x_m, 2.0 * pose.y_m, pose.heading_rad};
  ASSERT_TRUE(map_views(memory, odometry, executor));
  EXPECT_NEAR(memory.route("walk")->length_m(), 4.0 * unit_m, 0.02 * unit_m) << "a corrected scale";
  EXPECT_EQ(memory.route("in steps of its own")->length_m(), 2.0) << "no length is known";
}

TEST_F(MemoryMaps, RefusesDistancesThatMeanNothing) {
  const auto truth = rounds(40);
  MemoryFile memory = make_memory();
  for (std::size_t i = 0; i < 30; ++i) append(memory, round_room_signature(world, truth[i]));
  for (int i = 0; i < 4; ++i) append(memory, empty_view());
  ASSERT_TRUE(map_views(memory, {}, executor));
  const auto views = memory.views();
  EXPECT_THROW(scale_to_metres(memory, views[0], views[0], 1.0, "s"), ContractError);
  EXPECT_THROW(scale_to_metres(memory, views[0], views[32], 1.0, "s"), ContractError);
  EXPECT_THROW(scale_to_metres(memory, views[0], ViewId{999}, 1.0, "s"), ContractError);
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    EXPECT_THROW(scale_to_metres(memory, views[0], views[5], bad, "s"), ContractError);
  }
  EXPECT_EQ(read_length_unit(memory), LengthUnit::view_steps);
}

}  // namespace
}  // namespace panonav::testing
