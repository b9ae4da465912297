#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

// Non-linear least squares by damped Gauss-Newton steps. Users of this header must link Eigen.

namespace panonav {

/// Returns the weight of a residual under Cauchy's loss; `squared`: square of residual / scale.
[[nodiscard]] constexpr double cauchy_weight(double squared) noexcept {
  return 1.0 / (1.0 + squared);
}
/// Returns the weight under the Geman-McClure loss, which is almost 0 for residuals far above the
/// scale.
[[nodiscard]] constexpr double geman_mcclure_weight(double squared) noexcept {
  return 1.0 / ((1.0 + squared) * (1.0 + squared));
}
/// Returns the weight under Tukey's biweight loss, which is 0 for residuals above the scale.
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
  Vector right;                                              ///< negative gradient of the cost
  double min_reciprocal_condition = 0.0;                     ///< `solve` fails below it

  /// Sets all to zero; for a fixed number of unknowns.
  void set_zero() {
    matrix.setZero();
    right.setZero();
  }
  /// Solves the equations with the diagonal multiplied by 1 + damping. nullopt if they are too
  /// badly conditioned or the solution is not finite.
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

/// Sparse normal equations, for many unknowns of which each residual depends on few.
class SparseEquations {
 public:
  /// Sets all to zero, for this number of unknowns.
  void reset(int unknowns) {
    entries_.clear();
    right_ = Eigen::VectorXd::Zero(unknowns);
  }
  /// Adds `value` to an entry of the symmetric matrix, of which only one triangle is stored; `row`
  /// and `column` may be swapped.
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
    analysed_ = analysed_ && has_same_pattern(made);
    matrix_.swap(made);
    diagonal_ = matrix_.diagonal();
  }
  /// Solves the equations with the diagonal multiplied by 1 + damping, plus a tiny share of its
  /// largest entry; without damping, unchanged. nullopt if the factorisation fails. Every unknown
  /// needs a diagonal entry. Cost: one factorisation, whose ordering is computed again only if the
  /// sparsity pattern has changed.
  [[nodiscard]] std::optional<Eigen::VectorXd> solve(double damping = 0.0) {
    if (damping > 0.0) {
      // Share of the largest diagonal entry that is added to all, well above rounding, so that
      // undetermined unknowns do not move.
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

  [[nodiscard]] bool has_same_pattern(const Matrix& other) const {
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

/// Damping and termination criteria of `minimise`.
struct LeastSquaresOptions {
  int max_steps = 20;                  ///< >= 0
  double damping = 0.0;                ///< of the first step, as a share of the diagonal
  int max_attempts = 8;                ///< per step, each with ten times the last damping
  double min_decrease = 0.0;           ///< ends after a step that lowers the cost by at most this
  double min_relative_decrease = 0.0;  ///< the same, as a share of the cost
};

/// Outcome of a minimisation.
struct LeastSquaresReport {
  int steps = 0;           ///< linearisations that were made
  bool converged = false;  ///< false: `max_steps` were not enough
  bool solvable = true;    ///< false: the equations could not be set up or solved
};

/// Minimises a sum of weighted squares, from the present estimate of `problem`, which provides:
///
///   bool linearise(Equations&)  fills the equations at the present estimate, with weights that
///                               stay until the next call; false ends the minimisation
///   move(change)                changes the estimate
///
/// If `problem` has `double cost()`, `undo()` and `accept()`, only steps that lower the cost
/// are accepted (Levenberg-Marquardt): `undo` restores the estimate before `move`; damping
/// grows tenfold after each failure and falls tenfold after each success. Otherwise all
/// steps are accepted at constant damping (Gauss-Newton), and `bool move(change)` returns
/// true once the estimate has converged. Deterministic. Throws what the problem throws.
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
