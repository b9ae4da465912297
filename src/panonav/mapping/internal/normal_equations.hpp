#pragma once

#include <Eigen/Core>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <optional>
#include <vector>

namespace panonav {

/// The sparse normal equations of weighted least squares, H change = -gradient with H = J^T W J,
/// made anew for each step of Gauss and Newton.
class NormalEquations {
 public:
  void begin(int unknowns) {
    entries_.clear();
    gradient_ = Eigen::VectorXd::Zero(unknowns);
  }
  /// Adds to H, of which only one triangle is kept: `row` and `column` may come in either order.
  void add(int row, int column, double value) {
    entries_.emplace_back(std::max(row, column), std::min(row, column), value);
  }
  [[nodiscard]] double& gradient(int unknown) { return gradient_[unknown]; }
  /// After the last `add`.
  void assemble() {
    const Eigen::Index size = gradient_.size();
    Matrix made(size, size);
    made.setFromTriplets(entries_.begin(), entries_.end());
    analysed_ = analysed_ && has_pattern_of(made);
    matrix_.swap(made);
    diagonal_ = matrix_.diagonal();
  }
  /// With (1 + damping) times the diagonal and a trace of its largest value; with no damping as it
  /// is. Empty when it cannot be solved so. Every unknown must have an entry on the diagonal. Cost:
  /// one sparse factorisation; its order is found anew only when the pattern has changed.
  [[nodiscard]] std::optional<Eigen::VectorXd> solve(double damping = 0.0) {
    if (damping > 0.0) {
      const double floor = 1e-9 * std::max(diagonal_.maxCoeff(), 1e-9);
      for (int i = 0; i < diagonal_.size(); ++i) {
        matrix_.coeffRef(i, i) = diagonal_(i) * (1.0 + damping) + floor;
      }
    }
    if (!analysed_) factors_.analyzePattern(matrix_);
    analysed_ = true;
    factors_.factorize(matrix_);
    if (factors_.info() != Eigen::Success) return std::nullopt;
    Eigen::VectorXd change = factors_.solve(-gradient_);
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
  Eigen::VectorXd gradient_;
  Matrix matrix_;
  Eigen::VectorXd diagonal_;
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factors_;
  bool analysed_ = false;
};

}  // namespace panonav
