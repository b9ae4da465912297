#include "panonav/mapping/internal/path_variance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav::testing {
namespace {

constexpr double step_deviation_m = 0.02;
constexpr double turn_deviation_rad = 0.01;

/// Steps of 1 m along a line, from node to node.
std::vector<PoseEdge> straight_steps(std::size_t nodes) {
  std::vector<PoseEdge> edges;
  for (std::size_t i = 1; i < nodes; ++i) {
    edges.push_back({i - 1, i, {1.0, 0.0, 0.0}, step_deviation_m, turn_deviation_rad});
  }
  return edges;
}

std::vector<Pose2> straight_poses(std::size_t nodes) {
  std::vector<Pose2> poses(nodes);
  for (std::size_t i = 0; i < nodes; ++i) poses[i].x_m = static_cast<double>(i);
  return poses;
}

TEST(PathVariance, HeadingErrorsMoveTheEndByTheirDistance) {
  const auto edges = straight_steps(4);
  const std::vector<double> weights(edges.size(), 1.0);
  const auto poses = straight_poses(4);
  PathVariances variances(edges, weights, poses, 3, 4.0);
  EXPECT_EQ(variances.in_frame_of(3).position_m2, 0.0);
  const double turn2 = turn_deviation_rad * turn_deviation_rad;
  // Errors of the turns at nodes 1 and 2, seen from node 0, move node 3 by 2 m and 1 m times them.
  const double expected = 3.0 * step_deviation_m * step_deviation_m + (9.0 + 4.0 + 1.0) * turn2;
  EXPECT_NEAR(variances.in_frame_of(0).position_m2, 4.0 * expected, 1e-12);
  EXPECT_NEAR(variances.in_frame_of(0).heading_rad2, 4.0 * 3.0 * turn2, 1e-12);
}

TEST(PathVariance, AClosureShortensThePathAndAnIslandHasNone) {
  auto edges = straight_steps(30);
  std::vector<double> weights(edges.size(), 1.0);
  const auto poses = straight_poses(31);
  PathVariances open(edges, weights, poses, 29, 1.0);
  const double open_m2 = open.in_frame_of(0).position_m2;
  const double near_m2 = open.in_frame_of(28).position_m2;
  edges.push_back({0, 28, {28.0, 0.0, 0.0}, 0.05, 0.001, true});
  weights.push_back(1.0);
  PathVariances closed(edges, weights, poses, 29, 1.0);
  EXPECT_LT(closed.in_frame_of(0).position_m2, 0.1 * open_m2);
  EXPECT_EQ(closed.in_frame_of(28).position_m2, near_m2);
  EXPECT_TRUE(std::isinf(closed.in_frame_of(30).position_m2));
  weights.back() = 0.0;  // one that the map refutes does not count
  EXPECT_EQ(PathVariances(edges, weights, poses, 29, 1.0).in_frame_of(0).position_m2, open_m2);
}

TEST(PathVariance, TheOrderOfQuestionsDoesNotMatter) {
  Random random(3);
  auto edges = straight_steps(200);
  auto poses = straight_poses(200);
  for (std::size_t i = 0; i + 40 < 200; i += 7) {
    edges.push_back({i, i + 40, {40.0, 0.0, 0.0}, random.uniform(0.01, 0.5), 0.01, true});
  }
  const std::vector<double> weights(edges.size(), 0.5);
  PathVariances near_first(edges, weights, poses, 199, 1.0);
  std::vector<PathVariance> found;
  for (std::size_t i = 200; i-- > 0;) found.push_back(near_first.in_frame_of(i));
  PathVariances far_first(edges, weights, poses, 199, 1.0);
  for (std::size_t i = 0; i < 200; ++i) {
    const PathVariance variance = far_first.in_frame_of(i);
    EXPECT_EQ(variance.position_m2, found[199 - i].position_m2) << i;
    EXPECT_EQ(variance.heading_rad2, found[199 - i].heading_rad2) << i;
    EXPECT_EQ(PathVariances(edges, weights, poses, 199, 1.0).in_frame_of(i).position_m2,
              variance.position_m2);
  }
}

/// Steps whose errors have `factor` times the variances that they state, with 40 exact closures, of
/// which `wrong` are at a wrong place.
std::vector<PoseEdge> noisy_drive(double factor, int wrong, std::uint64_t seed) {
  Random random(seed);
  const double scale = std::sqrt(factor);
  std::vector<PoseEdge> edges = straight_steps(801);
  for (PoseEdge& edge : edges) {
    edge.a_from_b = {1.0 + scale * random.normal(0.0, step_deviation_m),
                     scale * random.normal(0.0, step_deviation_m),
                     scale * random.normal(0.0, turn_deviation_rad)};
  }
  for (std::size_t i = 0; i < 40; ++i) {
    PoseEdge closure{20 * i, 20 * i + 20, {20.0, 0.0, 0.0}, 0.01, 0.001, true};
    if (static_cast<int>(i) < wrong) closure.a_from_b.x_m = 3.0;
    edges.push_back(closure);
  }
  return edges;
}

TEST(PathVariance, ClosuresShowTheErrorsOfSteps) {
  for (const double factor : {0.04, 1.0, 9.0}) {
    for (const int wrong : {0, 2}) {
      const auto learnt = learn_step_factor(noisy_drive(factor, wrong, 5), 801);
      ASSERT_TRUE(learnt.has_value());
      EXPECT_GT(*learnt, 0.5 * factor);
      EXPECT_LT(*learnt, 2.5 * factor);
    }
  }
}

TEST(PathVariance, FewClosuresShowNothing) {
  auto edges = noisy_drive(1.0, 0, 6);
  edges.resize(800 + 9);
  EXPECT_FALSE(learn_step_factor(edges, 801).has_value());
}

}  // namespace
}  // namespace panonav::testing
