// The components of the lattice: curve, graph, solver.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/dissimilarity_curve.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/mapping/internal/lattice_growth.hpp"
#include "panonav/mapping/internal/lattice_links.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"

namespace panonav {
namespace {

TEST(DissimilarityCurve, FindsTheCurveThatPairsFollow) {
  Random random(1);
  std::vector<DissimilarityCurve::Sample> pairs;
  const auto truth = [](double distance) { return 100.0 * (1.0 - std::exp(-distance)); };
  for (int i = 0; i < 4000; ++i) {
    const double distance = random.uniform(0.0, 2.0);
    pairs.push_back({truth(distance), distance});
  }
  const DissimilarityCurve curve(pairs, 80.0);
  for (const double distance : {0.1, 0.5, 1.0, 1.8}) {
    EXPECT_NEAR(curve.distance(truth(distance)), distance, 0.02) << distance;
  }
  EXPECT_NEAR(curve.max_dissimilarity(), 76.0, 1e-9);
  EXPECT_NEAR(curve.range(), -std::log(0.24), 0.02);
  EXPECT_EQ(curve.distance(0.0), 0.0);
}

TEST(DissimilarityCurve, RisesWithErrorAndStiffnessAsInEquation5) {
  Random random(2);
  std::vector<DissimilarityCurve::Sample> pairs;
  for (int i = 0; i < 3000; ++i) {
    const double distance = random.uniform(0.0, 3.0);
    pairs.push_back(
        {std::max(0.0, distance + random.normal(0.0, 0.05 + 0.2 * distance)), distance});
  }
  const DissimilarityCurve curve(pairs, 2.5);
  double distance = 0.0;
  double error = 0.0;
  double stiffness = 1.0;
  for (double d = 0.0; d < 4.0; d += 0.05) {
    EXPECT_GE(curve.distance(d), distance);
    distance = curve.distance(d);
    EXPECT_GE(curve.error(distance), error);
    error = curve.error(distance);
    EXPECT_LE(curve.stiffness(distance), stiffness);
    stiffness = curve.stiffness(distance);
    EXPECT_NEAR(stiffness, std::exp(std::log(0.1) * error / curve.error(curve.range())), 1e-12);
  }
  EXPECT_NEAR(curve.stiffness(curve.range()), 0.1, 1e-12);
  EXPECT_EQ(curve.stiffness(0.0), 1.0);
}

TEST(DissimilarityCurve, TakesWhatHasNoExtent) {
  const std::vector<DissimilarityCurve::Sample> equal(5, DissimilarityCurve::Sample{0.0, 0.0});
  const DissimilarityCurve curve(equal, 0.0);
  EXPECT_EQ(curve.distance(0.0), 0.0);
  EXPECT_EQ(curve.stiffness(0.0), 1.0);
  EXPECT_NEAR(DissimilarityCurve(0.5).distance(3.0), 1.5, 1e-9);
}

TEST(DissimilarityCurve, RefusesWhatIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)DissimilarityCurve({}, 1.0), ContractError);
  EXPECT_THROW((void)DissimilarityCurve{0.0}, ContractError);
  EXPECT_THROW((void)DissimilarityCurve{nan}, ContractError);
  const std::vector<DissimilarityCurve::Sample> wrong{{nan, 1.0}};
  EXPECT_THROW((void)DissimilarityCurve(wrong, 1.0), ContractError);
}

TEST(LatticeGraph, PartsAndWays) {
  const std::vector<GraphEdge> edges{{5, 6, 1.0}, {0, 1, 1.0}, {1, 2, 2.0}, {0, 2, 4.0}};
  const LatticeGraph graph(7, edges);
  EXPECT_EQ(graph.components(), (std::vector<std::size_t>{0, 0, 0, 2, 3, 1, 1}));
  const auto ways = graph.shortest_path_lengths(0);
  EXPECT_EQ(ways[2], 3.0);
  EXPECT_TRUE(std::isinf(ways[5]));
  EXPECT_THROW(LatticeGraph(2, edges), ContractError);
}

struct World {
  std::vector<Pose2> truth;
  std::vector<SpringTerm> springs;
};

/// Poses at random, with exact springs between all that are near.
World random_world(std::uint64_t seed, bool directions) {
  Random random(seed);
  World world;
  for (int i = 0; i < 40; ++i) {
    world.truth.push_back({random.uniform(0.0, 4.0), random.uniform(0.0, 3.0),
                           random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  for (std::size_t a = 0; a < world.truth.size(); ++a) {
    for (std::size_t b = a + 1; b < world.truth.size(); ++b) {
      const Pose2 step = inverse(world.truth[a]) * world.truth[b];
      const Pose2 back = inverse(world.truth[b]) * world.truth[a];
      const double length = std::hypot(step.x_m, step.y_m);
      if (length > 1.5) continue;
      SpringTerm spring{.a = a, .b = b, .length = length, .length_deviation = 0.05};
      if (directions) {
        spring.direction =
            SpringDirection{std::atan2(step.y_m, step.x_m), std::atan2(back.y_m, back.x_m), 0.05};
        spring.turn = SpringTurn{step.heading_rad, 0.02};
      }
      world.springs.push_back(spring);
    }
  }
  return world;
}

std::vector<Pose2> shaken(const World& world, std::uint64_t seed, double by) {
  Random random(seed);
  auto poses = world.truth;
  for (Pose2& pose : poses) {
    pose.x_m += random.normal(0.0, by);
    pose.y_m += random.normal(0.0, by);
    pose.heading_rad = wrap_angle(pose.heading_rad + random.normal(0.0, by));
  }
  return poses;
}

double rms_to_ground_truth(const World& world, const std::vector<Pose2>& poses) {
  std::vector<Point2> truth;
  std::vector<Point2> found;
  for (const Pose2& pose : world.truth) truth.push_back(pose.position());
  for (const Pose2& pose : poses) found.push_back(pose.position());
  return align(found, truth).rms_m;
}

TEST(LatticeSolver, ExactSpringsGiveTheTruth) {
  for (const bool directions : {false, true}) {
    const World world = random_world(4, directions);
    ASSERT_GT(world.springs.size(), 100U);
    auto poses = shaken(world, 5, 0.1);
    ASSERT_GT(rms_to_ground_truth(world, poses), 0.05);
    const auto solution = solve_lattice(world.springs, poses);
    EXPECT_LT(rms_to_ground_truth(world, poses), 1e-4);
    EXPECT_LT(solution.energy, 1e-3);
    for (const double weight : solution.weights) EXPECT_GT(weight, 0.99);
  }
}

TEST(LatticeSolver, GivesUpSpringsThatContradictTheOthers) {
  World world = random_world(6, true);
  const std::size_t right = world.springs.size();
  Random random(7);
  for (int i = 0; i < 60; ++i) {
    const auto a = static_cast<std::size_t>(random.index(20));
    const auto b = 20 + static_cast<std::size_t>(random.index(20));
    if (distance(world.truth[a].position(), world.truth[b].position()) < 1.5) continue;
    world.springs.push_back(
        {.a = a,
         .b = b,
         .length = 0.3,
         .length_deviation = 0.05,
         .direction = SpringDirection{random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), 0.05},
         .turn = SpringTurn{random.uniform(-3.0, 3.0), 0.02}});
  }
  ASSERT_GT(world.springs.size(), right + 20);
  auto poses = shaken(world, 8, 0.1);
  const auto solution = solve_lattice(world.springs, poses);
  EXPECT_LT(rms_to_ground_truth(world, poses), 0.01);
  for (std::size_t s = 0; s < world.springs.size(); ++s) {
    if (s < right) {
      EXPECT_GT(solution.weights[s], 0.9);
    } else {
      EXPECT_LT(solution.weights[s], 0.1);
    }
  }
}

TEST(LatticeSolver, PosesThatMayNotMoveStay) {
  const World world = random_world(9, true);
  auto poses = shaken(world, 10, 0.05);
  std::vector<unsigned char> moving(poses.size(), 0);
  moving[3] = 1;
  auto fixed = world.truth;
  fixed[3] = poses[3];
  static_cast<void>(solve_lattice(world.springs, fixed, moving));
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    EXPECT_NEAR(distance(fixed[i].position(), world.truth[i].position()), 0.0, i == 3 ? 1e-5 : 0.0);
  }
}

TEST(LatticeSolver, SpringsWithoutLengthOrOnTheSpotDoNoHarm) {
  std::vector<Pose2> poses(3);
  const std::vector<SpringTerm> springs{{.a = 0, .b = 1, .length = 0.0, .length_deviation = 0.1},
                                        {.a = 1, .b = 2, .length = 1.0, .length_deviation = 0.1}};
  static_cast<void>(solve_lattice(springs, poses));
  EXPECT_NEAR(distance(poses[0].position(), poses[1].position()), 0.0, 1e-4);
  EXPECT_NEAR(distance(poses[1].position(), poses[2].position()), 1.0, 1e-4);
}

TEST(LatticeSolver, RefusesWhatIsOutOfRange) {
  std::vector<Pose2> poses(2);
  const auto refused = [&](const SpringTerm& spring) {
    EXPECT_THROW((void)solve_lattice(std::vector{spring}, poses), ContractError);
  };
  refused({.a = 0, .b = 2});
  refused({.a = 1, .b = 1});
  refused({.a = 0, .b = 1, .length = -1.0});
  refused({.a = 0, .b = 1, .length_deviation = 0.0});
  refused({.a = 0, .b = 1, .turn = SpringTurn{std::nan(""), 0.1}});
  poses[0].x_m = std::nan("");
  EXPECT_THROW((void)solve_lattice({}, poses), ContractError);
}

/// Views of two halls, and springs between those of one hall that stand near each other, read with
/// errors as from phases. The nearer, the less is left unexplained.
struct TwoHalls {
  std::vector<Pose2> poses;
  std::vector<Lattice::Spring> springs;
  static constexpr std::size_t views = 36;  // of each

  explicit TwoHalls(std::uint64_t seed) : random(seed) {
    for (std::size_t i = 0; i < 2 * views; ++i) {
      const std::size_t at = i % views;
      poses.push_back({static_cast<double>(at % 6), static_cast<double>(at / 6),
                       random.uniform(-std::numbers::pi, std::numbers::pi)});
    }
    for (std::size_t a = 0; a < 2 * views; ++a) {
      for (std::size_t b = a + 1; b < 2 * views; ++b) {
        if (a / views != b / views) continue;
        const double far = distance(poses[a].position(), poses[b].position());
        if (far < 2.1) link(a, b, inverse(poses[a]) * poses[b], 0.1 * far);
      }
    }
  }
  void link(std::size_t a, std::size_t b, const Pose2& step, double residual) {
    const Pose2 back = inverse(step);
    Lattice::Spring spring{.a = a, .b = b, .dissimilarity = residual, .excess_over_mirror = 0.6};
    spring.phases =
        PhaseReading{.turn_rad = wrap_angle(step.heading_rad + random.normal(0.0, 0.03)),
                     .direction_a_rad = std::atan2(step.y_m, step.x_m) + random.normal(0.0, 0.08),
                     .direction_b_rad = std::atan2(back.y_m, back.x_m) + random.normal(0.0, 0.08),
                     .length = std::hypot(step.x_m, step.y_m) * std::exp(random.normal(0.0, 0.15)),
                     .has_direction = true,
                     .residual = residual + random.uniform(0.0, 0.05)};
    springs.push_back(spring);
  }
  /// Places of the two halls that look alike: in the one as in the other, but never as much as
  /// neighbours.
  void link_alike(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t a = 7 * i % views;
      const std::size_t b = views + (a + 1) % views;
      link(a, b, {1.0, 0.0, random.uniform(-std::numbers::pi, std::numbers::pi)}, 0.15);
    }
  }
  Random random;
};

TEST(LatticeGrowth, FindsTheShapeAndKeepsWhatOnlyLooksAlikeApart) {
  TwoHalls halls(3);
  halls.link_alike(8);
  const GrownLayout grown = grow_components(halls.poses.size(), halls.springs, 1.0);
  std::vector<Point2> found;
  std::vector<Point2> truth;
  for (std::size_t i = 0; i < halls.poses.size(); ++i) {
    ASSERT_EQ(grown.layout.components[i], i / TwoHalls::views) << i;
    if (i >= TwoHalls::views) continue;
    found.push_back(grown.layout.poses[i].position());
    truth.push_back(halls.poses[i].position());
    EXPECT_NEAR(angle_difference(grown.layout.poses[i].heading_rad - halls.poses[i].heading_rad,
                                 grown.layout.poses[0].heading_rad - halls.poses[0].heading_rad),
                0.0, 0.1);
  }
  EXPECT_LT(shape_difference(found, truth).value, 0.01);
  for (const Lattice::Spring& spring : halls.springs) {
    const bool false_one = spring.a / TwoHalls::views != spring.b / TwoHalls::views;
    EXPECT_EQ(grown.weights.contains({spring.a, spring.b}), !false_one);
  }
}

TEST(LatticeGrowth, AFalseSpringDoesNotFoldAHall) {
  TwoHalls halls(4);
  // Opposite corners look alike.
  halls.link(0, TwoHalls::views - 1, {0.5, 0.0, 1.0}, 0.12);
  halls.link(1, TwoHalls::views - 2, {0.5, 0.0, -2.0}, 0.12);
  const GrownLayout grown = grow_components(halls.poses.size(), halls.springs, 1.0);
  const double across = distance(grown.layout.poses[0].position(),
                                 grown.layout.poses[TwoHalls::views - 1].position());
  EXPECT_NEAR(across, std::hypot(5.0, 5.0), 0.7);
  EXPECT_FALSE(fits_layout(halls.springs.back(), 1.0, grown.layout.poses[1],
                           grown.layout.poses[TwoHalls::views - 2]));
}

TEST(LatticeGrowth, LinksThatFitAMirroredViewAsWellAreNotCertain) {
  TwoHalls halls(6);
  const auto certain = make_links(halls.poses.size(), halls.springs, 1.0);
  const std::size_t doubtful = halls.springs.size() / 2;
  halls.springs[doubtful].excess_over_mirror = 0.0;
  const auto links = make_links(halls.poses.size(), halls.springs, 1.0);
  ASSERT_EQ(links.size(), certain.size());
  for (std::size_t k = 0; k < links.size(); ++k) {
    if (k == doubtful) {
      EXPECT_LT(links[k].probability, 0.5);
      EXPECT_GT(certain[k].probability, 0.5);
    } else {
      EXPECT_EQ(links[k].probability, certain[k].probability);
    }
  }
}

TEST(LatticeGrowth, TheOrderOfViewsDoesNotMatter) {
  TwoHalls halls(5);
  halls.link_alike(8);
  const GrownLayout grown = grow_components(halls.poses.size(), halls.springs, 1.0);
  const std::size_t last = halls.poses.size() - 1;
  std::vector<Lattice::Spring> reversed = halls.springs;
  for (Lattice::Spring& spring : reversed) {
    spring.a = last - spring.a;
    spring.b = last - spring.b;
  }
  const GrownLayout again = grow_components(halls.poses.size(), reversed, 1.0);
  std::vector<Point2> one;
  std::vector<Point2> other;
  for (std::size_t i = 0; i < TwoHalls::views; ++i) {
    one.push_back(grown.layout.poses[i].position());
    other.push_back(again.layout.poses[last - i].position());
    EXPECT_EQ(again.layout.components[last - i], again.layout.components[last]);
  }
  EXPECT_LT(shape_difference(one, other).value, 1e-3);
}

}  // namespace
}  // namespace panonav
