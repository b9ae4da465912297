#include "panonav/geometry/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

// The oracle is dense. The pattern of the matrix changes from trial to trial, and stays from one
// solution of a trial to the next.
TEST(SparseEquations, AreSolvedAsTheDenseOnes) {
  Random random(11);
  SparseEquations equations;
  int solved = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const int size = 3 + static_cast<int>(random.index(12));
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < 2 * size; ++i) {
      pairs.emplace_back(random.index(size), random.index(size));
    }
    for (const double damping : {0.0, 0.1, 0.0}) {
      equations.reset(size);
      Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
      for (int i = 0; i < size; ++i) {
        equations.add(i, i, 0.5);
        dense(i, i) += 0.5;
        right[i] = equations.right(i) = random.normal();
      }
      for (const auto& [a, b] : pairs) {
        if (a == b) continue;
        const double stiffness = random.uniform(0.5, 2.0);  // (x_a - x_b)^2
        equations.add(a, a, stiffness);
        equations.add(b, b, stiffness);
        equations.add(a, b, -stiffness);
        dense(a, a) += stiffness;
        dense(b, b) += stiffness;
        dense(a, b) -= stiffness;
        dense(b, a) -= stiffness;
      }
      equations.assemble();
      const auto found = equations.solve(damping);
      ASSERT_TRUE(found);
      dense.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd expected = dense.ldlt().solve(right);
      EXPECT_LE((*found - expected).norm(), 1e-6 * expected.norm());
      ++solved;
    }
  }
  EXPECT_EQ(solved, 60);
}

TEST(DenseEquations, OfAnArcTooShortHaveNoSolution) {
  DenseEquations<2> equations;
  equations.set_zero();
  equations.matrix << 1.0, 1.0, 1.0, 1.0 + 1e-9;
  equations.right << 1.0, 1.0;
  EXPECT_TRUE(equations.solve());
  equations.min_reciprocal_condition = 1e-5;
  EXPECT_FALSE(equations.solve());
}

// Rosenbrock's valley, 10 (y - x^2) and 1 - x, whose floor is bent: undamped steps leave it.
struct Valley {
  double x = -1.2, y = 1.0, start_x = 0.0, start_y = 0.0;
  int accepted = 0, undone = 0;

  bool linearise(DenseEquations<2>& equations) {
    start_x = x;
    start_y = y;
    const Eigen::RowVector2d first(-20.0 * x, 10.0);
    const Eigen::RowVector2d second(-1.0, 0.0);
    equations.matrix = first.transpose() * first + second.transpose() * second;
    equations.right = -10.0 * (y - x * x) * first.transpose() - (1.0 - x) * second.transpose();
    return true;
  }
  [[nodiscard]] double cost() const {
    return 100.0 * (y - x * x) * (y - x * x) + (1.0 - x) * (1.0 - x);
  }
  void move(const Eigen::Vector2d& change) {
    x += change[0];
    y += change[1];
  }
  void accept() { ++accepted; }
  void undo() {
    ++undone;
    x = start_x;
    y = start_y;
  }
};

TEST(Minimise, FollowsABentValleyToItsEnd) {
  Valley valley;
  DenseEquations<2> equations;
  const double start = valley.cost();
  const auto report = minimise(valley, equations,
                               {.max_steps = 100, .damping = 1e-3, .min_relative_decrease = 1e-12});
  EXPECT_TRUE(report.converged);
  EXPECT_TRUE(report.solvable);
  EXPECT_NEAR(valley.x, 1.0, 1e-6);
  EXPECT_NEAR(valley.y, 1.0, 1e-6);
  EXPECT_LT(valley.cost(), 1e-12 * start);
  EXPECT_GT(valley.undone, 0);  // a guard: steps that are too long do come up
  EXPECT_LE(valley.accepted, report.steps);
}

// The square root of 2 by Newton's rule, without a cost.
struct Root {
  double value = 1.0;
  bool can_linearise = true;

  bool linearise(DenseEquations<1>& equations) const {
    equations.matrix(0, 0) = 4.0 * value * value;
    equations.right[0] = -2.0 * value * (value * value - 2.0);
    return can_linearise;
  }
  bool move(const Eigen::Matrix<double, 1, 1>& change) {
    value += change[0];
    return std::abs(change[0]) < 1e-9;
  }
};

TEST(Minimise, TakesEachStepOfAProblemWithoutACost) {
  Root root;
  DenseEquations<1> equations;
  const auto report = minimise(root, equations, {.max_steps = 10});
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.steps, 8);
  EXPECT_NEAR(root.value, std::sqrt(2.0), 1e-12);

  Root short_of_it;
  EXPECT_FALSE(minimise(short_of_it, equations, {.max_steps = 2}).converged);
  EXPECT_GT(std::abs(short_of_it.value - std::sqrt(2.0)), 1e-4);

  Root blind{.can_linearise = false};
  EXPECT_FALSE(minimise(blind, equations, {.max_steps = 10}).solvable);
  EXPECT_EQ(blind.value, 1.0);
}

TEST(SparseEquations, OfAnUnknownThatNothingHoldsHaveNoSolutionUnlessDamped) {
  SparseEquations equations;
  equations.reset(2);
  equations.add(0, 0, 1.0);
  equations.add(1, 1, 0.0);
  equations.assemble();
  EXPECT_FALSE(equations.solve());
  EXPECT_TRUE(equations.solve(1e-6));
}

}  // namespace
}  // namespace panonav
