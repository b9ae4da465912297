#include "panonav/mapping/pose_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/odometry.hpp"

namespace panonav {
namespace {

std::vector<Point2> positions(const std::vector<Pose2>& poses) {
  std::vector<Point2> points;
  for (const Pose2& pose : poses) points.push_back(pose.position());
  return points;
}

// Once around a circle of 5 m, looking ahead; the last pose is beside the first.
std::vector<Pose2> circle(std::size_t count) {
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    poses.push_back({5.0 * std::sin(angle), 5.0 - 5.0 * std::cos(angle), wrap_angle(angle)});
  }
  return poses;
}

struct Graph {
  std::vector<Pose2> nodes;
  std::vector<PoseEdge> edges;
};

// The edges that a robot with noisy odometry gives.
Graph driven(const std::vector<Pose2>& truth, std::uint64_t seed) {
  Graph graph{{truth.front()}, {}};
  Random random(seed);
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
    Pose2 step = inverse(truth[i]) * truth[i + 1];
    step.x_m *= 1.0 + 0.05 * random.normal();
    step.heading_rad += 0.01 * random.normal() + 0.004;
    graph.nodes.push_back(graph.nodes.back() * step);
    graph.edges.push_back({i, i + 1, step, 0.02, 0.01});
  }
  return graph;
}

TEST(PoseGraph, ExactEdgesBringDisplacedNodesBack) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto truth = circle(40);
    Graph graph{truth, {}};
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const std::size_t next = (i + 1) % truth.size();
      graph.edges.push_back({i, next, inverse(truth[i]) * truth[next], 0.1, 0.05});
    }
    Random random(seed);
    for (std::size_t i = 1; i < truth.size(); ++i) {
      graph.nodes[i].x_m += random.uniform(-0.5, 0.5);
      graph.nodes[i].y_m += random.uniform(-0.5, 0.5);
      graph.nodes[i].heading_rad =
          wrap_angle(graph.nodes[i].heading_rad + random.uniform(-0.4, 0.4));
    }
    const auto report = optimise_pose_graph(graph.nodes, graph.edges);
    EXPECT_TRUE(report.settled);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_NEAR(graph.nodes[i].x_m, truth[i].x_m, 1e-4) << "seed " << seed;
      EXPECT_NEAR(graph.nodes[i].y_m, truth[i].y_m, 1e-4);
      EXPECT_NEAR(angle_difference(graph.nodes[i].heading_rad, truth[i].heading_rad), 0.0, 1e-4);
    }
  }
}

TEST(PoseGraph, MovingAllNodesMovesTheSolution) {
  const auto truth = circle(30);
  Graph graph = driven(truth, 7);
  graph.edges.push_back({29, 0, inverse(truth[29]) * truth[0], 0.02, 0.01, true});
  Graph moved = graph;
  const Pose2 elsewhere{3.0, -2.0, 2.5};
  for (Pose2& node : moved.nodes) node = elsewhere * node;
  optimise_pose_graph(graph.nodes, graph.edges);
  optimise_pose_graph(moved.nodes, moved.edges);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Pose2 expected = elsewhere * graph.nodes[i];
    EXPECT_NEAR(moved.nodes[i].x_m, expected.x_m, 1e-3);
    EXPECT_NEAR(moved.nodes[i].y_m, expected.y_m, 1e-3);
  }
}

TEST(PoseGraph, ClosureTakesDriftAway) {
  const auto truth = circle(200);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Graph graph = driven(truth, seed);
    const double before = shape_difference(positions(graph.nodes), positions(truth)).value;
    graph.edges.push_back({199, 0, inverse(truth[199]) * truth[0], 0.02, 0.01, true});
    const auto report = optimise_pose_graph(graph.nodes, graph.edges);
    const double after = shape_difference(positions(graph.nodes), positions(truth)).value;
    EXPECT_GT(before, 0.003) << "seed " << seed;  // guard: there was drift to take away
    EXPECT_LT(after, 0.3 * before) << "seed " << seed;
    EXPECT_GT(report.edge_weights.back(), 0.3);
  }
}

TEST(PoseGraph, AWrongClosureLosesAgainstRightOnes) {
  const auto truth = circle(200);
  Graph graph = driven(truth, 3);
  for (const std::size_t back : {1U, 2U, 3U}) {
    const std::size_t i = 200 - back;
    graph.edges.push_back({i, 0, inverse(truth[i]) * truth[0], 0.02, 0.01, true});
  }
  Graph with_wrong = graph;
  // The far side of the circle is said to be the start.
  with_wrong.edges.push_back({100, 0, Pose2{}, 0.02, 0.01, true});
  optimise_pose_graph(graph.nodes, graph.edges);
  const auto report = optimise_pose_graph(with_wrong.nodes, with_wrong.edges);
  EXPECT_LT(report.edge_weights.back(), 0.01);
  EXPECT_GT(report.edge_weights[report.edge_weights.size() - 2], 0.3);
  EXPECT_LT(shape_difference(positions(graph.nodes), positions(with_wrong.nodes)).value, 1e-3);
}

TEST(PoseGraph, PartsWithoutAnEdgeBetweenThemStayApart) {
  const std::vector<PoseEdge> edges{{0, 1, {1.0, 0.0, 0.0}}, {3, 4, {1.0, 0.0, 0.0}}};
  EXPECT_EQ(connected_components(5, edges), (std::vector<std::size_t>{0, 0, 1, 2, 2}));
  std::vector<Pose2> nodes{{0, 0, 0}, {3, 0, 0}, {9, 9, 1}, {5, 5, 0}, {5, 6, 0}};
  optimise_pose_graph(nodes, edges);
  EXPECT_NEAR(nodes[1].x_m, 1.0, 1e-4);
  EXPECT_EQ(nodes[2], (Pose2{9, 9, 1}));
  EXPECT_EQ(nodes[3], (Pose2{5, 5, 0}));
  EXPECT_NEAR(nodes[4].x_m, 6.0, 1e-4);
  EXPECT_NEAR(nodes[4].y_m, 5.0, 1e-4);
}

TEST(PoseGraph, FixedNodesStay) {
  const std::vector<PoseEdge> edges{{0, 1, {1.0, 0.0, 0.0}}, {1, 2, {1.0, 0.0, 0.0}}};
  std::vector<Pose2> nodes{{0, 0, 0}, {5, 1, 0}, {2, 0, 0}};
  const std::vector<std::uint8_t> fixed{1, 0, 1};
  optimise_pose_graph(nodes, edges, {}, fixed);
  EXPECT_EQ(nodes[0], (Pose2{0, 0, 0}));
  EXPECT_EQ(nodes[2], (Pose2{2, 0, 0}));
  EXPECT_NEAR(nodes[1].x_m, 1.0, 1e-3);
  EXPECT_NEAR(nodes[1].y_m, 0.0, 1e-3);
  const std::vector<std::uint8_t> too_few{1};
  EXPECT_THROW(optimise_pose_graph(nodes, edges, {}, too_few), ContractError);
}

TEST(PoseGraph, NothingToDo) {
  std::vector<Pose2> none;
  EXPECT_EQ(optimise_pose_graph(none, {}).iterations, 0);
  std::vector<Pose2> one{{1.0, 2.0, 3.0}};
  EXPECT_TRUE(optimise_pose_graph(one, {}).settled);
  EXPECT_EQ(one[0], (Pose2{1.0, 2.0, 3.0}));
  EXPECT_TRUE(connected_components(0, {}).empty());
}

TEST(PoseGraph, RefusesWhatHasNoMeaning) {
  std::vector<Pose2> nodes(2);
  const auto with = [&](const PoseEdge& edge) {
    const std::vector<PoseEdge> edges{edge};
    optimise_pose_graph(nodes, edges);
  };
  EXPECT_THROW(with({0, 2, {}}), ContractError);
  EXPECT_THROW(with({1, 1, {}}), ContractError);
  EXPECT_THROW(with({0, 1, {}, 0.0, 0.1}), ContractError);
  EXPECT_THROW(with({0, 1, {}, 0.1, std::numeric_limits<double>::quiet_NaN()}), ContractError);
  EXPECT_THROW(with({0, 1, {std::numeric_limits<double>::quiet_NaN(), 0, 0}}), ContractError);
  nodes[1].x_m = std::numeric_limits<double>::infinity();
  EXPECT_THROW(with({0, 1, {}}), ContractError);
  nodes[1].x_m = 0.0;
  EXPECT_THROW(optimise_pose_graph(nodes, {}, {.max_iterations = 0}), OptionError);
}

}  // namespace
}  // namespace panonav
