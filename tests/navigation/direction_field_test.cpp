#include "panonav/navigation/direction_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_graphs.hpp"

namespace panonav::testing {
namespace {

// The nodes from `start` to where the tree ends.
std::vector<std::size_t> followed(const std::vector<Guide>& guides, std::size_t start) {
  std::vector<std::size_t> path{start};
  while (guides[path.back()].next != path.back() && path.size() <= guides.size()) {
    path.push_back(guides[path.back()].next);
  }
  return path;
}

TEST(DirectionField, WaysAreTheShortestOnes) {
  std::size_t unreachable = 0;
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const NavigationGraph graph = random_graph(30, 20 + seed, seed);
    std::vector<std::uint8_t> closed(graph.edges().size(), 0);
    for (std::size_t p = 0; p < closed.size(); p += 7) closed[p] = 1;
    const auto path_lengths = compute_all_path_lengths(graph, closed);
    for (std::size_t goal = 0; goal < graph.size(); goal += 5) {
      const auto guides = direction_field(graph, graph.view(goal), {}, closed);
      for (std::size_t node = 0; node < graph.size(); ++node) {
        const double truth = path_lengths[goal * graph.size() + node];
        ASSERT_EQ(guides[node].is_reachable(), std::isfinite(truth));
        if (!guides[node].is_reachable()) {
          ++unreachable;
          continue;
        }
        ++compared;
        ASSERT_NEAR(guides[node].path_length, truth, 1e-9);
        const auto path = followed(guides, node);
        ASSERT_EQ(path.front(), node);
        ASSERT_EQ(path.back(), goal);
        double length = 0.0;
        for (std::size_t i = 0; i + 1 < path.size(); ++i) {
          const std::size_t edge = guides[path[i]].edge;
          ASSERT_EQ(closed[edge], 0);
          length += graph.edges()[edge].length;
        }
        ASSERT_NEAR(length, truth, 1e-9);
      }
    }
  }
  EXPECT_GT(unreachable, 100U);
  EXPECT_GT(compared, 1000U);
}

// Poses of random headings on a grid: the direction in the frame of each is that to the next ones.
TEST(DirectionField, DirectionsPointAlongTheWayInTheFrameOfEachView) {
  Random random(4);
  std::vector<Pose2> poses;
  for (int i = 0; i < 64; ++i) {
    poses.push_back({1.0 * (i % 8) + random.uniform(-0.2, 0.2),
                     1.0 * (i / 8) + random.uniform(-0.2, 0.2),
                     random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  const NavigationGraph graph = posed_graph(poses, 1.7, [](Point2, Point2) { return true; });
  const std::size_t goal = 27;
  const auto one = direction_field(graph, graph.view(goal), {.links_ahead = 1});
  const auto three = direction_field(graph, graph.view(goal), {.links_ahead = 3});
  double error_one = 0.0;
  double error_three = 0.0;
  for (std::size_t node = 0; node < graph.size(); ++node) {
    if (node == goal) {
      EXPECT_FALSE(one[node].direction_rad.has_value());
      continue;
    }
    const Pose2 next = inverse(poses[node]) * poses[one[node].next];
    ASSERT_TRUE(one[node].direction_rad && three[node].direction_rad);
    EXPECT_NEAR(angle_difference(*one[node].direction_rad, std::atan2(next.y_m, next.x_m)), 0.0,
                1e-9);
    const Pose2 end = inverse(poses[node]) * poses[goal];
    const double straight = std::atan2(end.y_m, end.x_m);
    error_one += std::abs(angle_difference(*one[node].direction_rad, straight));
    error_three += std::abs(angle_difference(*three[node].direction_rad, straight));
  }
  // Nothing is in the way here, so the smoother direction is nearer to the straight one.
  EXPECT_LT(error_three, error_one);
}

TEST(DirectionField, DoesNotLookRoundCorners) {
  // East twice, then north: from the start the third edge must not count.
  const std::vector<Pose2> poses{{0, 0, 0.5}, {1, 0, 0}, {1, 1, 0}, {1, 2, 0}};
  const NavigationGraph graph = posed_graph(poses, 1.1, [](Point2, Point2) { return true; });
  const auto guides = direction_field(graph, graph.view(3), {.links_ahead = 3});
  ASSERT_TRUE(guides[0].direction_rad.has_value());
  EXPECT_NEAR(*guides[0].direction_rad, -0.5, 1e-9);
}

TEST(DirectionField, RefusesWhatIsNotThere) {
  const NavigationGraph graph = random_graph(5, 6, 1);
  EXPECT_THROW((void)direction_field(graph, ViewId{11}), ContractError);
  EXPECT_THROW((void)direction_field(graph, graph.view(0), {.links_ahead = 0}), OptionError);
  const std::vector<std::uint8_t> wrong(1, 0);
  if (graph.edges().size() != 1) {
    EXPECT_THROW((void)direction_field(graph, graph.view(0), {}, wrong), ContractError);
  }
}

TEST(NavigationGraph, KnowsBothWaysOfAnEdge) {
  const Pose2 a_from_b{1.0, 2.0, 0.7};
  const NavigationGraph graph({ViewId{3}, ViewId{9}},
                              {{ViewId{9}, ViewId{3}, 2.0, a_from_b}, {ViewId{3}, ViewId{9}, 5.0}});
  ASSERT_EQ(graph.edges().size(), 1U);
  EXPECT_EQ(graph.edges()[0].length, 2.0);
  EXPECT_EQ(*graph.motion_from(1, 0), a_from_b);
  const Pose2 round = *graph.motion_from(0, 0) * *graph.motion_from(1, 0);
  EXPECT_NEAR(round.x_m, 0.0, 1e-12);
  EXPECT_NEAR(round.y_m, 0.0, 1e-12);
  EXPECT_NEAR(round.heading_rad, 0.0, 1e-12);
  EXPECT_EQ(graph.exits(0)[0].node, 1U);
  EXPECT_EQ(graph.exits(1)[0].node, 0U);
  EXPECT_FALSE(graph.node_of(ViewId{4}).has_value());
  EXPECT_THROW(NavigationGraph({ViewId{3}}, {{ViewId{3}, ViewId{4}}}), ContractError);
  EXPECT_THROW(NavigationGraph({ViewId{3}}, {{ViewId{3}, ViewId{3}}}), ContractError);
  EXPECT_THROW(NavigationGraph({ViewId{3}, ViewId{4}}, {{ViewId{3}, ViewId{4}, 0.0}}),
               ContractError);
  EXPECT_THROW(NavigationGraph({ViewId{4}, ViewId{3}}, {}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
