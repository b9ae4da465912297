#include "panonav/mapping/lattice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

constexpr RoomKind room_kind{.width_m = 6.0, .depth_m = 5.0, .boxes = 3, .contrast = 0.2};

/// A memory of every free place of a grid in the middle of a room, in random headings.
struct Place {
  Room room;
  std::vector<Pose2> poses;
  VisualMemory memory;

  Place(std::uint64_t seed, double step_m)
      : room(seed, room_kind), memory(remember(seed, step_m)) {}

 private:
  VisualMemory remember(std::uint64_t seed, double step_m) {
    Random random(seed, 1);
    std::vector<FourierSignature> signatures;
    std::vector<std::optional<ReferencePose>> known;
    for (double x = 1.5; x < 4.6; x += step_m) {
      for (double y = 1.3; y < 3.8; y += step_m) {
        if (!room.is_free({x, y})) continue;
        poses.push_back({x, y, random.uniform(-std::numbers::pi, std::numbers::pi)});
        signatures.push_back(compute_signature(room.see(poses.back(), 24, 128)));
        known.push_back(ReferencePose{x, y, poses.back().heading_rad});
      }
    }
    return make_memory(signatures, known);
  }
};

std::vector<Point2> positions_of(const Lattice& lattice) {
  std::vector<Point2> points;
  for (const auto& node : lattice.nodes) points.push_back(node.pose.position());
  return points;
}

std::vector<Point2> true_positions(const VisualMemory& memory) {
  std::vector<Point2> points;
  for (const ViewId view : memory.views()) points.push_back(memory.info(view).pose->position());
  return points;
}

Lattice arrange(const VisualMemory& memory, const LatticeOptions& options = {},
                const std::vector<CoarseMotion>& motion = {}, int threads = 1) {
  Executor executor(threads);
  return panonav::arrange(memory, options, motion, executor);
}

/// Views of some of the room's places, once more from scratch.
VisualMemory memory_of(const std::vector<FourierSignature>& signatures) {
  return make_memory(signatures,
                     std::vector<std::optional<ReferencePose>>(signatures.size(), std::nullopt));
}

FourierSignature seen(const Room& room, const Pose2& pose) {
  return compute_signature(room.see(pose, 24, 128));
}

std::vector<Point2> inner_grid(const Room& room, double step_m) {
  std::vector<Point2> points;
  for (const Point2 p : room.grid(step_m)) {
    if (p.x_m > 1.2 && p.x_m < 4.8 && p.y_m > 1.2 && p.y_m < 3.8) points.push_back(p);
  }
  return points;
}

TEST(Lattice, UnorderedViewsArrangeThemselvesLikeTheirRoom) {
  std::vector<double> differences;
  std::vector<double> heading_errors;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    const Place place(seed, 0.3);
    ASSERT_GT(place.memory.size(), 60U);
    const Lattice lattice = arrange(place.memory);
    ASSERT_EQ(lattice.nodes.size(), place.memory.size());
    // A view of which nothing certain is known stays apart.
    ASSERT_GE(lattice.components[0].views, 95 * place.memory.size() / 100);
    EXPECT_TRUE(lattice.components[0].handedness_known);
    EXPECT_FALSE(lattice.metric);
    EXPECT_GE(lattice.candidates, lattice.springs.size());
    // No mirror image is allowed: directions tell which one it is.
    std::vector<Point2> found;
    std::vector<Point2> truth;
    for (const auto& node : lattice.nodes) {
      if (node.component != 0) continue;
      found.push_back(node.pose.position());
      truth.push_back(place.memory.info(node.view).pose->position());
    }
    differences.push_back(shape_difference(found, truth).value);
    // Headings come with it, up to the frame.
    const Alignment turned = align(found, truth, {.allow_scale = true});
    std::vector<double> errors;
    for (const auto& node : lattice.nodes) {
      if (node.component != 0) continue;
      errors.push_back(std::abs(angle_difference(node.pose.heading_rad + turned.rotation_rad,
                                                 *place.memory.info(node.view).pose->heading_rad)));
    }
    heading_errors.push_back(upper_median(errors));
  }
  EXPECT_LT(upper_median(differences), 0.02);
  EXPECT_LT(upper_median(heading_errors), radians(5.0));
}

TEST(Lattice, OrderOfViewsAndTheirPosesDoNotMatter) {
  const Place place(4, 0.4);
  std::vector<FourierSignature> signatures;
  std::vector<Point2> truth;
  for (const ViewId view : place.memory.views()) {
    signatures.push_back(place.memory.signature(view));
    truth.push_back(place.memory.info(view).pose->position());
  }
  std::ranges::reverse(signatures);
  std::ranges::reverse(truth);
  const Lattice lattice = arrange(memory_of(signatures));
  EXPECT_LT(shape_difference(positions_of(lattice), truth).value, 0.03);
}

TEST(Lattice, SameBitsOnAnyNumberOfThreads) {
  const Place place(5, 0.5);
  const Lattice one = arrange(place.memory);
  const Lattice three = arrange(place.memory, {}, {}, 3);
  ASSERT_EQ(one.nodes.size(), three.nodes.size());
  for (std::size_t i = 0; i < one.nodes.size(); ++i) {
    EXPECT_EQ(one.nodes[i].pose, three.nodes[i].pose);
  }
  EXPECT_EQ(one.energy, three.energy);
}

TEST(Lattice, WhoWatchesSeesItUnfoldAndChangesNothing) {
  const Place place(5, 0.5);
  for (const bool phases : {true, false}) {
    const LatticeOptions options{.phases = phases};
    const Lattice alone = arrange(place.memory, options);
    std::size_t steps = 0;
    std::size_t groups_at_first = 0;
    std::size_t groups_at_last = 0;
    Executor executor(1);
    const Lattice watched = panonav::arrange(
        place.memory, options, {}, executor,
        [&](std::span<const Pose2> poses, std::span<const std::size_t> components) {
          EXPECT_EQ(poses.size(), place.memory.size());
          ASSERT_EQ(components.size(), place.memory.size());
          groups_at_last = std::set(components.begin(), components.end()).size();
          if (steps++ == 0) groups_at_first = groups_at_last;
        });
    EXPECT_GT(steps, 5U);
    EXPECT_EQ(groups_at_last, watched.components.size());
    if (phases) {
      EXPECT_GT(groups_at_first, place.memory.size() / 2) << "groups grow from single views";
    }
    EXPECT_EQ(watched.energy, alone.energy);
    for (std::size_t i = 0; i < alone.nodes.size(); ++i) {
      EXPECT_EQ(watched.nodes[i].pose, alone.nodes[i].pose);
    }
  }
}

TEST(Lattice, WithoutPhasesHandednessIsUnknown) {
  const Place place(6, 0.4);
  const Lattice lattice = arrange(place.memory, {.phases = false});
  ASSERT_FALSE(lattice.components.empty());
  for (const auto& component : lattice.components) EXPECT_FALSE(component.handedness_known);
  for (const auto& spring : lattice.springs) EXPECT_FALSE(spring.phases.has_value());
  // Worse than with phases.
  const auto difference =
      shape_difference(positions_of(lattice), true_positions(place.memory)).with_reflection;
  EXPECT_LT(difference, 0.8);
  EXPECT_GT(
      difference,
      shape_difference(positions_of(arrange(place.memory)), true_positions(place.memory)).value);
}

TEST(Lattice, SpringsGrowWithTheViewsNotWithTheirPairs) {
  const Place place(7, 0.25);
  const LatticeOptions options{.neighbours = 8, .rounds = 2};
  const Lattice lattice = arrange(place.memory, options);
  const std::size_t views = place.memory.size();
  ASSERT_GT(views, 80U);
  EXPECT_LE(lattice.springs.size(),
            views * static_cast<std::size_t>(options.neighbours * options.rounds));
  EXPECT_GE(lattice.springs.size(), views);
}

TEST(Lattice, CoarseMotionGivesMetres) {
  const Place place(8, 0.4);
  Random random(9);
  std::vector<CoarseMotion> motion;
  const auto views = place.memory.views();
  for (std::size_t i = 0; i + 1 < views.size(); ++i) {
    const auto& a = *place.memory.info(views[i]).pose;
    const auto& b = *place.memory.info(views[i + 1]).pose;
    Pose2 step = inverse(Pose2{a.x_m, a.y_m, *a.heading_rad}) * Pose2{b.x_m, b.y_m, *b.heading_rad};
    const double travel = std::hypot(step.x_m, step.y_m);
    step.x_m += random.normal(0.0, 0.1 * travel);
    step.y_m += random.normal(0.0, 0.1 * travel);
    step.heading_rad = wrap_angle(step.heading_rad + random.normal(0.0, 0.1));
    motion.push_back({.from = views[i],
                      .to = views[i + 1],
                      .step = step,
                      .distance_deviation_m = 0.1 * travel,
                      .direction_deviation_rad = 0.1,
                      .turn_deviation_rad = 0.1});
  }
  const Lattice lattice = arrange(place.memory, {}, motion);
  EXPECT_TRUE(lattice.metric);
  ASSERT_EQ(lattice.components.size(), 1U);
  const auto fit =
      align(positions_of(lattice), true_positions(place.memory), {.allow_scale = true});
  EXPECT_NEAR(fit.scale, 1.0, 0.2);
  EXPECT_LT(fit.rms_m, 0.2);
}

TEST(Lattice, DisconnectedGroupsStayParts) {
  const Room one(21, room_kind);
  const Room other(22, room_kind);
  std::vector<FourierSignature> signatures;
  std::vector<int> room_of;
  for (const auto& [room, number] : {std::pair{&one, 0}, std::pair{&other, 1}}) {
    for (const Point2 p : inner_grid(*room, 0.4)) {
      signatures.push_back(seen(*room, {p.x_m, p.y_m, 0.3}));
      room_of.push_back(number);
    }
  }
  const Lattice lattice = arrange(memory_of(signatures));
  ASSERT_GE(lattice.components.size(), 2U);
  for (const auto& spring : lattice.springs) EXPECT_EQ(room_of[spring.a], room_of[spring.b]);
  std::size_t counted = 0;
  for (const auto& component : lattice.components) counted += component.views;
  EXPECT_EQ(counted, signatures.size());
  EXPECT_GE(lattice.components[1].views, 20U);
}

TEST(Lattice, ViewsOfTwoRoomsAreNotJoined) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    std::vector<FourierSignature> signatures;
    std::vector<std::size_t> room_of;
    for (std::size_t i = 0; i < 2; ++i) {
      const Place place(20 * i + seed, 0.4);
      for (const Pose2& pose : place.poses) {
        signatures.push_back(compute_signature(place.room.see(pose, 24, 128)));
        room_of.push_back(i);
      }
    }
    Executor executor;
    const Lattice lattice = arrange(make_memory(signatures), {}, {}, executor);
    std::map<std::size_t, std::array<std::size_t, 2>> views_of_component;
    for (std::size_t i = 0; i < room_of.size(); ++i)
      ++views_of_component[lattice.nodes[i].component][room_of[i]];
    // Single views may be attached to the wrong room, at even odds.
    for (const auto& [component, views] : views_of_component) {
      EXPECT_LE(std::min(views[0], views[1]), room_of.size() / 20)
          << "seed " << seed << ", component " << component;
    }
    EXPECT_TRUE(lattice.joins.empty()) << "seed " << seed;
    EXPECT_GE(lattice.components.at(1).views, room_of.size() / 3) << "seed " << seed;
  }
}

TEST(Lattice, DegenerateMemories) {
  const Room room(31, room_kind);
  const VisualMemory none({24, 15}, 1.0F, std::nullopt);
  EXPECT_TRUE(arrange(none).nodes.empty());

  const FourierSignature here = seen(room, {1.0, 1.0, 0.0});
  const Lattice one = arrange(memory_of({here}));
  ASSERT_EQ(one.nodes.size(), 1U);
  EXPECT_EQ(one.nodes[0].pose, Pose2{});
  EXPECT_EQ(one.components.size(), 1U);

  const FourierSignature there = seen(room, {1.2, 1.0, 0.5});
  const Lattice two = arrange(memory_of({here, there}));
  ASSERT_EQ(two.components.size(), 1U);
  EXPECT_NEAR(distance(two.nodes[0].pose.position(), two.nodes[1].pose.position()), 1.0, 1e-3);
  EXPECT_NEAR(two.nodes[1].pose.heading_rad, 0.5, radians(5.0));
  EXPECT_NEAR(std::atan2(two.nodes[1].pose.y_m, two.nodes[1].pose.x_m), 0.0, radians(20.0));

  const Lattice equal = arrange(memory_of(std::vector<FourierSignature>(5, here)));
  for (const auto& node : equal.nodes) {
    EXPECT_NEAR(distance(node.pose.position(), {}), 0.0, 1e-3);
  }

  // No structure at all: no phases, no difference.
  const Panorama grey(24, 128, std::nullopt);
  const Lattice empty =
      arrange(memory_of(std::vector<FourierSignature>(3, compute_signature(grey))));
  EXPECT_EQ(empty.nodes.size(), 3U);
  for (const auto& node : empty.nodes) EXPECT_TRUE(std::isfinite(node.pose.x_m));
}

TEST(Lattice, AViewTwiceLiesAtOnePlace) {
  const Room room(32, room_kind);
  std::vector<FourierSignature> signatures;
  for (const Point2 p : inner_grid(room, 0.4))
    signatures.push_back(seen(room, {p.x_m, p.y_m, 0.0}));
  signatures.push_back(turn(signatures[7], 0.7));
  const Lattice lattice = arrange(memory_of(signatures));
  ASSERT_EQ(lattice.nodes[7].component, lattice.nodes.back().component);
  const Pose2& first = lattice.nodes[7].pose;
  const Pose2& again = lattice.nodes.back().pose;
  EXPECT_LT(distance(first.position(), again.position()), 0.15);
  EXPECT_NEAR(angle_difference(again.heading_rad, first.heading_rad), 0.7, radians(3.0));
}

TEST(Lattice, PairsOfEqualViewsHaveOneResult) {
  const Room room(32, room_kind);
  const auto here = seen(room, {3.0, 2.0, 0.0});
  const auto there = seen(room, {3.2, 2.1, 0.0});
  const VisualMemory memory = memory_of({here, there, here, turn(here, 0.7), there});
  const SpringViews views(memory, {});
  EXPECT_EQ(views.find_first_equal({2, 4}), NodePair(0, 1));
  EXPECT_EQ(views.find_first_equal({4, 3}), NodePair(1, 3));  // a turned view is another one
  EXPECT_EQ(views.direction_probability({2, 4}), views.direction_probability({0, 1}));
  EXPECT_GT(views.direction_probability({0, 1}), 0.0);  // guard
}

TEST(Lattice, ViewsThatCameLaterFindTheirPlace) {
  const Place place(7, 0.3);
  std::vector<FourierSignature> signatures;
  for (const ViewId view : place.memory.views()) signatures.push_back(place.memory.signature(view));
  // Every sixth view comes later: all around the others.
  std::vector<std::size_t> order;
  std::vector<std::size_t> later;
  for (std::size_t i = 0; i < signatures.size(); ++i) (i % 6 == 3 ? later : order).push_back(i);
  const std::size_t first = order.size();
  order.insert(order.end(), later.begin(), later.end());
  std::vector<FourierSignature> ordered;
  std::vector<Point2> truth;
  for (const std::size_t i : order) {
    ordered.push_back(signatures[i]);
    truth.push_back(place.poses[i].position());
  }
  const VisualMemory all = memory_of(ordered);
  VisualMemory memory(all);
  for (std::size_t i = first; i < order.size(); ++i) memory.remove(all.views()[i]);
  Lattice lattice = arrange(memory);
  ASSERT_EQ(lattice.nodes.size(), first);
  // Those of the largest component beside the truth.
  struct Placed {
    std::vector<Point2> found, truth;
  };
  const auto placed = [&] {
    Placed result;
    for (std::size_t i = 0; i < lattice.nodes.size(); ++i) {
      if (lattice.nodes[i].component != 0) continue;
      result.found.push_back(lattice.nodes[i].pose.position());
      result.truth.push_back(truth[i]);
    }
    return result;
  };
  const Placed before = placed();
  ASSERT_GE(before.found.size(), 95 * first / 100);
  extend(lattice, all);
  ASSERT_EQ(lattice.nodes.size(), order.size());
  const Placed after = placed();
  // All new views find it.
  EXPECT_EQ(after.found.size() - before.found.size(), order.size() - first);
  const double difference_before = shape_difference(before.found, before.truth).value;
  EXPECT_LT(shape_difference(after.found, after.truth).value, difference_before + 0.01);
  // New views lie about as well as the old ones.
  const auto fit = align(before.found, before.truth, {.allow_scale = true});
  std::vector<double> errors;
  for (std::size_t i = first; i < order.size(); ++i) {
    errors.push_back(distance(fit.apply(lattice.nodes[i].pose.position()), truth[i]));
  }
  EXPECT_LT(upper_median(errors), 1.5 * fit.rms_m + 0.02);
  // Nothing new: nothing happens.
  const auto settled = positions_of(lattice);
  extend(lattice, all);
  EXPECT_EQ(positions_of(lattice), settled);
}

TEST(Lattice, GrowsFromNothing) {
  const Place place(8, 0.5);
  Lattice lattice;
  VisualMemory memory(place.memory.shape(), place.memory.full_scale(), place.memory.elevations());
  extend(lattice, memory);
  EXPECT_TRUE(lattice.nodes.empty());
  memory.append_with_id(ViewId{5}, place.memory.packed(place.memory.views()[0]), {.name = "first"});
  extend(lattice, memory);
  ASSERT_EQ(lattice.nodes.size(), 1U);
  memory.append_with_id(ViewId{3 + 5}, place.memory.packed(place.memory.views()[1]),
                        {.name = "second"});
  extend(lattice, memory);
  ASSERT_EQ(lattice.nodes.size(), 2U);
  for (const auto& node : lattice.nodes) EXPECT_TRUE(std::isfinite(node.pose.x_m));
  // A lattice of another memory.
  EXPECT_THROW(extend(lattice, place.memory), ContractError);
}

TEST(Lattice, AMapOfItHoldsAllNodesAndSprings) {
  const Place place(9, 0.5);
  const Lattice lattice = arrange(place.memory);
  const TopologicalMap map = to_topological_map(lattice);
  EXPECT_NO_THROW(validate(map));
  ASSERT_EQ(map.nodes.size(), lattice.nodes.size());
  ASSERT_EQ(map.edges.size(), lattice.springs.size());
  EXPECT_EQ(count_components(map), lattice.components.size());
  for (std::size_t s = 0; s < map.edges.size(); ++s) {
    const Pose2& a = lattice.nodes[lattice.springs[s].a].pose;
    const Pose2& b = lattice.nodes[lattice.springs[s].b].pose;
    EXPECT_LT(distance((a * map.edges[s].a_from_b).position(), b.position()), 1e-9);
  }
}

TEST(Lattice, RefusesMotionsThatAreNone) {
  const Place place(33, 0.6);
  const auto views = place.memory.views();
  const auto refused = [&](const CoarseMotion& motion) {
    EXPECT_THROW((void)arrange(place.memory, {}, {motion}), ContractError);
  };
  refused({.from = views[0], .to = ViewId{9999}});
  refused({.from = views[0], .to = views[1], .step = {std::nan(""), 0.0, 0.0}});
  refused({.from = views[0], .to = views[1], .turn_deviation_rad = 0.0});
  refused({.from = views[0],
           .to = views[1],
           .distance_deviation_m = std::numeric_limits<double>::infinity()});
  EXPECT_THROW((void)arrange(place.memory, {.neighbours = 0}), OptionError);
}

}  // namespace
}  // namespace panonav::testing
