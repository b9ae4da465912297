#include "panonav/mapping/topological_mapper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/odometry.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

constexpr int views_of_round = 110;
const VisualOdometryOptions in_metres{.scale_m = round_room_radius_m};

/// A mapper with the memory that it looks at.
struct Mapping {
  VisualMemory memory = empty_round_room_memory();
  TopologicalMapper mapper;
  explicit Mapping(const MappingOptions& options = {}) : mapper(memory, options, in_metres) {}

  TopologicalMapper::Update add(const FourierSignature& signature,
                                const std::optional<Pose2>& moved = std::nullopt,
                                std::size_t moved_nodes = 1) {
    const ViewId view = memory.append(signature, {.name = std::to_string(memory.size())});
    return mapper.add(view, OdometryView(signature), moved, moved_nodes);
  }
};

// Rounds of 10 m, looking ahead, with a view every 9 cm.
std::vector<Pose2> rounds(int views) {
  std::vector<Pose2> poses;
  for (int i = 0; i < views; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / views_of_round;
    poses.push_back({1.6 * std::sin(angle), -1.6 * std::cos(angle), wrap_angle(angle)});
  }
  return poses;
}

std::vector<Point2> positions(std::span<const Pose2> poses) {
  std::vector<Point2> points;
  for (const Pose2& pose : poses) points.push_back(pose.position());
  return points;
}

FourierSignature empty_view() {
  return compute_signature(Panorama(round_room_shape.rows, 96, std::nullopt),
                           round_room_shape.components);
}

TEST(TopologicalMapper, ClosesTheLoopOfASecondRound) {
  const ToyWorld world = round_room(round_room_radius_m, 5);
  const auto truth = rounds(views_of_round + 40);
  Mapping open({.close_loops = false});
  Mapping closed;
  std::size_t closures = 0;
  for (const Pose2& pose : truth) {
    open.add(round_room_signature(world, pose));
    for (const LoopClosure& closure : closed.add(round_room_signature(world, pose)).closures) {
      const Pose2 error = inverse(inverse(truth[closure.earlier]) * truth[closure.later]) *
                          closure.earlier_from_later;
      EXPECT_LT(std::hypot(error.x_m, error.y_m), 0.6);
      EXPECT_LT(std::abs(error.heading_rad), 0.1);
      ++closures;
    }
  }
  closed.mapper.finish();
  EXPECT_GE(closures, 4U);
  const double before = shape_difference(positions(open.mapper.poses()), positions(truth)).value;
  const double after = shape_difference(positions(closed.mapper.poses()), positions(truth)).value;
  EXPECT_LT(after, 0.006);
  EXPECT_LT(after, before);
  const TopologicalMap map = closed.mapper.map();
  EXPECT_EQ(map.nodes.size(), truth.size());
  EXPECT_LE(map.edges.size(), truth.size() - 1 + closures);
  EXPECT_GT(map.edges.size(), truth.size() - 1 + closures / 2);  // most are not refuted
  EXPECT_EQ(count_components(map), 1U);
}

TEST(TopologicalMapper, ClosesTheLoopOfADriveThatEndsWhereItBegan) {
  const ToyWorld world = round_room(round_room_radius_m, 5);
  const auto truth = rounds(views_of_round + 1);
  Mapping open({.close_loops = false});
  Mapping closed;
  for (const Pose2& pose : truth) {
    open.add(round_room_signature(world, pose));
    EXPECT_TRUE(closed.add(round_room_signature(world, pose)).closures.empty());
  }
  closed.mapper.finish();
  const TopologicalMap map = closed.mapper.map();
  EXPECT_EQ(map.edges.size(), truth.size());
  const Pose2 gap = inverse(map.nodes.front().pose) * map.nodes.back().pose;
  const Pose2 open_gap = inverse(open.mapper.poses().front()) * open.mapper.poses().back();
  EXPECT_LT(std::hypot(gap.x_m, gap.y_m), std::hypot(open_gap.x_m, open_gap.y_m));
  closed.mapper.finish();
  EXPECT_EQ(closed.mapper.map().edges.size(), truth.size());  // the loop is closed once
}

TEST(TopologicalMapper, WheelsSetTheScale) {
  const ToyWorld world = round_room(round_room_radius_m, 6);
  const auto truth = rounds(views_of_round + 20);
  Mapping mapping;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    mapping.add(round_room_signature(world, truth[i]),
                i == 0 ? std::nullopt : std::optional(inverse(truth[i - 1]) * truth[i]));
  }
  mapping.mapper.finish();
  EXPECT_LT(align(positions(mapping.mapper.poses()), positions(truth)).rms_m, 0.15);
}

std::vector<Pose2> poses_with_wheels(std::span<const FourierSignature> views,
                                     std::span<const Pose2> wheels) {
  Mapping mapping({.close_loops = false});
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::optional<Pose2> moved;
    if (i > 0) moved = inverse(wheels[i - 1]) * wheels[i];
    mapping.add(views[i], moved);
  }
  return {mapping.mapper.poses().begin(), mapping.mapper.poses().end()};
}

TEST(TopologicalMapper, FollowsTheWheelsWhereTheTurnsOfTheViewsDrift) {
  const ToyWorld world = round_room(round_room_radius_m, 12);
  const auto truth = rounds(views_of_round);
  std::vector<FourierSignature> views;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Pose2 drifted = truth[i] * Pose2{0.0, 0.0, 0.01 * static_cast<double>(i)};
    views.push_back(round_room_signature(world, drifted));
  }
  const auto poses = poses_with_wheels(views, truth);
  EXPECT_LT(align(positions(poses), positions(truth)).rms_m, 0.1);
}

TEST(TopologicalMapper, ClosuresAndViewsCorrectTheWheels) {
  const ToyWorld world = round_room(round_room_radius_m, 13);
  const auto truth = rounds(2 * views_of_round);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    std::vector<Pose2> alone{Pose2{}};
    Mapping mapping;
    mapping.add(round_room_signature(world, truth[0]));
    for (std::size_t i = 1; i < truth.size(); ++i) {
      const StepSampler noise(inverse(truth[i - 1]) * truth[i], OdometryNoise{});
      const Pose2 moved = noise.move({}, random);
      alone.push_back(alone.back() * moved);
      mapping.add(round_room_signature(world, truth[i]), moved);
    }
    mapping.mapper.finish();
    EXPECT_LT(align(positions(mapping.mapper.poses()), positions(truth)).rms_m,
              align(positions(alone), positions(truth)).rms_m);
  }
}

TEST(TopologicalMapper, RefusesClosuresThatTheWheelsRuleOut) {
  const ToyWorld world = round_room(round_room_radius_m, 14);
  const auto truth = rounds(2 * views_of_round);
  const auto count_closures_with = [&](const Pose2& error) {
    Mapping mapping;
    std::size_t closures = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      std::optional<Pose2> moved;
      if (i > 0) moved = inverse(truth[i - 1]) * truth[i] * error;
      closures += mapping.add(round_room_signature(world, truth[i]), moved).closures.size();
    }
    return closures;
  };
  EXPECT_GT(count_closures_with({}), 5U);
  // Wheels that drive along a line: the second round is at another place that looks the same.
  const Pose2 straight{0.0, 0.0, -2.0 * std::numbers::pi / views_of_round};
  EXPECT_EQ(count_closures_with(straight), 0U);
}

TEST(TopologicalMapper, SameViewsGiveTheSameBits) {
  const ToyWorld world = round_room(round_room_radius_m, 7);
  Mapping one;
  Mapping two;
  for (const Pose2& pose : rounds(views_of_round + 20)) {
    one.add(round_room_signature(world, pose));
    two.add(round_room_signature(world, pose));
  }
  EXPECT_EQ(one.mapper.map(), two.mapper.map());
}

TEST(TopologicalMapper, OneViewTwoViews) {
  const ToyWorld world = round_room(round_room_radius_m, 8);
  Mapping mapping;
  mapping.mapper.finish();
  EXPECT_TRUE(mapping.mapper.map().nodes.empty());
  EXPECT_TRUE(mapping.add(round_room_signature(world, {})).new_component);
  mapping.mapper.finish();
  EXPECT_EQ(mapping.mapper.map().nodes.size(), 1U);
  EXPECT_TRUE(mapping.mapper.map().edges.empty());
  EXPECT_FALSE(mapping.add(round_room_signature(world, {0.1, 0.0, 0.0})).new_component);
  EXPECT_EQ(mapping.mapper.map().edges.size(), 1U);
}

TEST(TopologicalMapper, EqualViewsStayAtOnePlace) {
  const ToyWorld world = round_room(round_room_radius_m, 9);
  Mapping mapping;
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(mapping.add(round_room_signature(world, {0.3, 0.1, 0.2})).closures.empty());
  }
  for (const Pose2& pose : mapping.mapper.poses()) {
    EXPECT_NEAR(std::hypot(pose.x_m, pose.y_m), 0.0, 1e-6);
  }
  Mapping keeping({.capture_difference = 0.01});
  keeping.add(round_room_signature(world, {0.3, 0.1, 0.2}));
  EXPECT_FALSE(keeping.mapper.is_new(OdometryView(round_room_signature(world, {0.3, 0.1, 0.9}))));
  EXPECT_TRUE(keeping.mapper.is_new(OdometryView(round_room_signature(world, {0.9, 0.1, 0.2}))));
}

TEST(TopologicalMapper, WhatNothingConnectsBecomesAPartOfItsOwn) {
  const ToyWorld world = round_room(round_room_radius_m, 10);
  const auto truth = rounds(views_of_round + 60);
  Mapping mapping;
  for (std::size_t i = 0; i < 60; ++i) mapping.add(round_room_signature(world, truth[i]));
  for (std::size_t i = 0; i < VisualOdometry::max_tried_views; ++i) {
    EXPECT_TRUE(mapping.add(empty_view()).new_component);
  }
  EXPECT_TRUE(mapping.add(round_room_signature(world, truth[60])).new_component);
  EXPECT_EQ(count_components(mapping.mapper.map()), 2U + VisualOdometry::max_tried_views);
  EXPECT_EQ(mapping.mapper.map().nodes.back().component, 1U + VisualOdometry::max_tried_views);
  // Wheels bridge what the views do not show.
  Mapping with_wheels;
  with_wheels.add(round_room_signature(world, truth[0]));
  EXPECT_FALSE(with_wheels.add(empty_view(), Pose2{0.1, 0.0, 0.0}).new_component);
  EXPECT_EQ(count_components(with_wheels.mapper.map()), 1U);
  Mapping bridged({.bridge_m = 0.5});
  bridged.add(round_room_signature(world, truth[0]));
  EXPECT_FALSE(bridged.add(empty_view()).new_component);
  EXPECT_NEAR(bridged.mapper.poses().back().x_m, 0.5, 1e-9);
  // The second round joins the components again.
  for (std::size_t i = 61; i < truth.size(); ++i)
    mapping.add(round_room_signature(world, truth[i]));
  mapping.mapper.finish();
  const TopologicalMap map = mapping.mapper.map();
  EXPECT_EQ(count_components(map), 1U + VisualOdometry::max_tried_views);
  EXPECT_EQ(map.nodes[0].component, map.nodes.back().component);
}

TEST(TopologicalMapper, PassesOverASingleViewWithoutStructure) {
  const ToyWorld world = round_room(round_room_radius_m, 12);
  const auto truth = rounds(4);
  Mapping mapping;
  mapping.add(round_room_signature(world, truth[0]));
  EXPECT_TRUE(mapping.add(empty_view()).new_component);
  const auto update = mapping.add(round_room_signature(world, truth[2]));
  EXPECT_FALSE(update.new_component);
  EXPECT_EQ(update.step.value().views, 2);
  const TopologicalMap map = mapping.mapper.map();
  EXPECT_EQ(map.nodes[2].component, map.nodes[0].component);
  EXPECT_NE(map.nodes[1].component, map.nodes[0].component);
  ASSERT_EQ(map.edges.size(), 1U);
  EXPECT_EQ(map.edges[0].a, map.nodes[0].view);
  // The next view that nothing connects gets a number that no other component has.
  for (std::size_t i = 0; i < VisualOdometry::max_tried_views; ++i) mapping.add(empty_view());
  mapping.add(round_room_signature(world, truth[3]));
  EXPECT_EQ(count_components(mapping.mapper.map()), 3U + VisualOdometry::max_tried_views);
}

TEST(TopologicalMapper, AStepOfTheWheelsMayPassOverNodes) {
  const ToyWorld world = round_room(round_room_radius_m, 11);
  const auto truth = rounds(4);
  const auto moved = [&](std::size_t from, std::size_t to) {
    return inverse(truth[from]) * truth[to];
  };
  for (const bool is_readable : {true, false}) {
    Mapping mapping;
    mapping.add(round_room_signature(world, truth[0]));
    mapping.add(round_room_signature(world, truth[1]), moved(0, 1));
    // The wheels are not known here.
    const auto update =
        mapping.add(is_readable ? round_room_signature(world, truth[2]) : empty_view());
    EXPECT_EQ(update.new_component, !is_readable);
    mapping.add(round_room_signature(world, truth[3]), moved(1, 3), 2);
    const auto map = mapping.mapper.map();
    EXPECT_EQ(map.nodes[3].component, map.nodes[0].component);
    EXPECT_EQ(map.nodes[2].component == map.nodes[0].component, is_readable);
    EXPECT_EQ(map.edges.back().a, map.nodes[1].view);
    EXPECT_LT(distance(map.edges.back().a_from_b.position(), moved(1, 3).position()), 1e-9);
  }
  Mapping mapping;
  mapping.add(round_room_signature(world, truth[0]));
  EXPECT_THROW(mapping.add(round_room_signature(world, truth[1]), moved(0, 1), 2), ContractError);
}

TEST(TopologicalMapper, RefusesWhatHasNoMeaning) {
  const ToyWorld world = round_room(round_room_radius_m, 11);
  Mapping mapping;
  const auto signature = round_room_signature(world, {});
  mapping.add(signature);
  const ViewId first = mapping.memory.views().front();
  EXPECT_THROW(mapping.mapper.add(first, OdometryView(signature)), ContractError);
  EXPECT_THROW(mapping.mapper.add(ViewId{99}, OdometryView(signature)), ContractError);
  const ViewId next = mapping.memory.append(signature, {.name = "next"});
  const Pose2 nan{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};
  EXPECT_THROW(mapping.mapper.add(next, OdometryView(signature), nan), ContractError);
  const OdometryView two_rows(compute_signature(Panorama(2, 256, std::nullopt), 14));
  EXPECT_THROW(mapping.mapper.add(next, two_rows), ContractError);
  EXPECT_EQ(mapping.mapper.size(), 1U);
  EXPECT_THROW(TopologicalMapper(mapping.memory, {.step_deviation = -1.0}), OptionError);
  EXPECT_THROW(TopologicalMapper(mapping.memory, {}, {}, {.candidates = 0}), OptionError);
}

}  // namespace
}  // namespace panonav::testing
