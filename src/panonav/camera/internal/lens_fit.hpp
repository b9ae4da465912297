#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "panonav/camera/internal/lens_pair.hpp"
#include "panonav/camera/internal/patch_matching.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::dual_fisheye {

/// Fits lenses and rotations to matches by robust least squares (Levenberg-Marquardt) about a
/// prior.
class LensFit {
 public:
  /// `prior_deviations`: standard deviation of each parameter about the prior. `fine_step_rad`:
  /// angle between samples at the finest resolution. `mirror_sign`: see `PosedLens`.
  LensFit(const Eigen::VectorXd& prior_deviations, double fine_step_rad, double mirror_sign,
          Executor& executor);

  /// Parameters as a prior and their offset from it.
  struct Parameters {
    State prior;
    Eigen::VectorXd offset;
  };
  /// Sets the parameters to the prior.
  void reset_to_prior(const State& prior);
  [[nodiscard]] const Parameters& parameters() const { return current_; }
  /// Sets the parameters and their prior, for example to those of an earlier fit.
  void set_parameters(const Parameters& parameters) { current_ = parameters; }

  /// Minimises `cost` from the present parameters; also estimates the standard deviation of a
  /// match.
  void solve(const std::vector<Match>& matches);
  /// Sets the fields of view so that they end at these image radii; false if a lens's image radius
  /// does not grow monotonically up to there.
  [[nodiscard]] bool set_max_angles(const std::array<double, 2>& radii_px);

  [[nodiscard]] State state() const { return apply_change(current_.prior, current_.offset); }
  /// Returns the estimated standard deviation of a match.
  [[nodiscard]] double deviation_rad() const { return deviation_rad_; }
  /// Returns the covariance of all parameters for residuals that are correlated within a region
  /// (White's sandwich with clusters).
  [[nodiscard]] Eigen::MatrixXd covariance(const std::vector<Match>& matches) const;

 private:
  using Slopes = Eigen::Matrix<double, 2, 2 * (lens_parameter_count + rotation_parameter_count)>;
  class LinearisedLenses;
  class Problem;
  /// Computes the normal equations of prior and matches: returns the matrix, and in `right` the
  /// negative gradient of the cost.
  [[nodiscard]] Eigen::MatrixXd compute_normal_equations(const State& state,
                                                         const std::vector<Match>& matches,
                                                         Eigen::VectorXd& right) const;
  [[nodiscard]] double cost(const Eigen::VectorXd& offset, const std::vector<Match>& matches) const;
  /// Estimates the standard deviation of a match from the median residual.
  void update_deviation(const std::vector<Match>& matches);

  Parameters current_;
  Eigen::VectorXd prior_information_;
  double fine_step_rad_;
  double mirror_sign_;
  Executor& executor_;
  double deviation_rad_ = 0.01;
};

}  // namespace panonav::dual_fisheye
