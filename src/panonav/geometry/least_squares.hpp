#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

// Non-linear least squares by damped Gauss-Newton steps. Whoever includes this links Eigen.

namespace panonav {

/// Weight of a residual by Cauchy's loss; `squared`: the residual over its scale, squared.
[[nodiscard]] constexpr double cauchy_weight(double squared) noexcept {
  return 1.0 / (1.0 + squared);
}
/// Returns the weight of the loss of Geman and McClure: residuals far beyond the scale have almost
/// none.
[[nodiscard]] constexpr double geman_mcclure_weight(double squared) noexcept {
  return 1.0 / ((1.0 + squared) * (1.0 + squared));
}
/// Returns the weight of Tukey's loss: 0 beyond the scale.
[[nodiscard]] constexpr double tukey_weight(double squared) noexcept {
  return squared < 1.0 ? (1.0 - squared) * (1.0 - squared) : 0.0;
}

/// Dense normal equations of weighted least squares, matrix * change = right with matrix = J^T W J
/// and right = -J^T W residuals. `unknowns`: their number, or Eigen::Dynamic.
template <int unknowns>
struct DenseEquations {
  using Matrix = Eigen::Matrix<double, unknowns, unknowns>;  ///< of the equations
  using Vector = Eigen::Matrix<double, unknowns, 1>;         ///< of one number for each unknown
  Matrix matrix;                                             ///< symmetric; both triangles
  Vector right;                                              ///< where the cost falls
  double min_reciprocal_condition = 0.0;                     ///< below it there is no solution

  /// Sets all to zero; for a fixed number of unknowns.
  void set_zero() {
    matrix.setZero();
    right.setZero();
  }
  /// Solves with (1 + damping) times the diagonal. Empty when the solution is not finite.
  [[nodiscard]] std::optional<Vector> solve(double damping = 0.0) const {
    Matrix damped = matrix;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix> factors(damped);
    if (min_reciprocal_condition > 0.0 &&
        (factors.info() != Eigen::Success || factors.rcond() < min_reciprocal_condition)) {
      return std::nullopt;
    }
    Vector change = factors.solve(right);
    if (!change.allFinite()) return std::nullopt;
    return change;
  }
};

/// Normal equations of many unknowns of which few share a residual.
class SparseEquations {
 public:
  /// Sets all to zero, for this number of unknowns.
  void reset(int unknowns) {
    entries_.clear();
    right_ = Eigen::VectorXd::Zero(unknowns);
  }
  /// Adds to the matrix, of which one triangle is kept: `row` and `column` come in either order.
  void add(int row, int column, double value) {
    entries_.emplace_back(std::max(row, column), std::min(row, column), value);
  }
  /// Entry of the right side.
  [[nodiscard]] double& right(int unknown) { return right_[unknown]; }
  /// Builds the matrix from the added entries.
  void assemble() {
    const Eigen::Index size = right_.size();
    Matrix made(size, size);
    made.setFromTriplets(entries_.begin(), entries_.end());
    analysed_ = analysed_ && has_pattern_of(made);
    matrix_.swap(made);
    diagonal_ = matrix_.diagonal();
  }
  /// Solves with (1 + damping) times the diagonal and a trace of its largest value; with no damping
  /// as it is. Empty when it cannot be solved so. Every unknown must have an entry on the diagonal.
  /// Cost: one factorisation; its order is found again only when the pattern has changed.
  [[nodiscard]] std::optional<Eigen::VectorXd> solve(double damping = 0.0) {
    if (damping > 0.0) {
      // A share of the largest value that rounding leaves, so that free unknowns stay where they
      // are.
      constexpr double trace_share = 1e-9;
      const double floor = trace_share * std::max(diagonal_.maxCoeff(), trace_share);
      for (int i = 0; i < diagonal_.size(); ++i) {
        matrix_.coeffRef(i, i) = diagonal_(i) * (1.0 + damping) + floor;
      }
    }
    if (!analysed_) factors_.analyzePattern(matrix_);
    analysed_ = true;
    factors_.factorize(matrix_);
    if (factors_.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXd change = factors_.solve(right_);
    if (!change.allFinite()) return std::nullopt;
    return change;
  }

 private:
  using Matrix = Eigen::SparseMatrix<double>;

  [[nodiscard]] bool has_pattern_of(const Matrix& other) const {
    return matrix_.rows() == other.rows() && matrix_.nonZeros() == other.nonZeros() &&
           std::equal(matrix_.outerIndexPtr(), matrix_.outerIndexPtr() + matrix_.outerSize() + 1,
                      other.outerIndexPtr()) &&
           std::equal(matrix_.innerIndexPtr(), matrix_.innerIndexPtr() + matrix_.nonZeros(),
                      other.innerIndexPtr());
  }

  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
  Matrix matrix_;
  Eigen::VectorXd diagonal_;
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factors_;
  bool analysed_ = false;
};

/// Damping of the steps of `minimise`, and when it ends.
struct LeastSquaresOptions {
  int max_steps = 20;         ///< >= 0
  double damping = 0.0;       ///< of the first step, as a share of the diagonal
  int max_attempts = 8;       ///< at one step, each with ten times the damping
  double min_decrease = 0.0;  ///< of the cost; a step that lowers it by no more is the last
  double min_relative_decrease = 0.0;  ///< the same, as a share of the cost
};

/// Outcome of a minimisation.
struct LeastSquaresReport {
  int steps = 0;           ///< linearisations that were made
  bool converged = false;  ///< false: `max_steps` were not enough
  bool solvable = true;    ///< false: the equations could not be set up or solved
};

/// Minimises a sum of weighted squares, from where `problem` stands:
///
///   bool linearise(Equations&)  fills the equations at the present estimate, with weights that
///                               stay until the next call; false ends the minimisation
///   move(change)                changes the estimate
///
/// With `double cost()`, `undo()` and `accept()` a step counts only where it lowers the cost (as
/// Levenberg and Marquardt do): `undo` goes back to before `move`, damping grows tenfold after each
/// failure and falls tenfold after each success. Without them each step counts, at constant
/// damping (Gauss-Newton), and `bool move(change)` says whether the estimate has converged.
/// Deterministic. Throws what the problem throws.
template <class Problem, class Equations>
LeastSquaresReport minimise(Problem& problem, Equations& equations,
                            const LeastSquaresOptions& options) {
  constexpr double damping_growth = 10.0;  // after a failure; Marquardt's value
  constexpr double damping_decay = 0.1;
  constexpr double min_damping = 1e-9;  // less hardly differs from none, and grows back slowly
  constexpr bool has_cost = requires {
    problem.cost();
  };
  LeastSquaresReport report;
  double damping = options.damping;
  while (report.steps < options.max_steps) {
    ++report.steps;
    report.solvable = problem.linearise(equations);
    if (!report.solvable) return report;
    if constexpr (has_cost) {
      const double before = problem.cost();
      double after = before;
      for (int attempt = 0; attempt < options.max_attempts && !(after < before); ++attempt) {
        after = before;
        if (const auto change = equations.solve(damping)) {
          problem.move(*change);
          after = problem.cost();
        }
        if (after < before) {
          damping = std::max(min_damping, damping * damping_decay);
          problem.accept();
        } else {
          damping *= damping_growth;
          problem.undo();
        }
      }
      const double enough = std::max(options.min_decrease, options.min_relative_decrease * before);
      report.converged = !(after < before) || before - after <= enough;
    } else {
      const auto change = equations.solve(damping);
      report.solvable = change.has_value();
      if (!change) return report;
      report.converged = problem.move(*change);
    }
    if (report.converged) return report;
  }
  return report;
}

}  // namespace panonav
