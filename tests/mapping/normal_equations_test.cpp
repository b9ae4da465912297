#include "panonav/mapping/internal/normal_equations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

// The oracle is dense. The pattern of the matrix changes from trial to trial, and stays from one
// solution of a trial to the next.
TEST(NormalEquations, AreSolvedAsTheDenseOnes) {
  Random random(11);
  NormalEquations equations;
  int solved = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const int size = 3 + static_cast<int>(random.index(12));
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < 2 * size; ++i) {
      pairs.emplace_back(random.index(size), random.index(size));
    }
    for (const double damping : {0.0, 0.1, 0.0}) {
      equations.begin(size);
      Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
      for (int i = 0; i < size; ++i) {
        equations.add(i, i, 0.5);
        dense(i, i) += 0.5;
        gradient[i] = equations.gradient(i) = random.normal();
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
      const Eigen::VectorXd expected = dense.ldlt().solve(-gradient);
      EXPECT_LE((*found - expected).norm(), 1e-6 * expected.norm());
      ++solved;
    }
  }
  EXPECT_EQ(solved, 60);
}

TEST(NormalEquations, OfAnUnknownThatNothingHoldsHaveNoSolutionUnlessDamped) {
  NormalEquations equations;
  equations.begin(2);
  equations.add(0, 0, 1.0);
  equations.add(1, 1, 0.0);
  equations.assemble();
  EXPECT_FALSE(equations.solve());
  EXPECT_TRUE(equations.solve(1e-6));
}

}  // namespace
}  // namespace panonav
