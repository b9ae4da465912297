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
  /// Takes the standard deviation of each parameter about the prior, and how far apart the finest
  /// values of the pictures are. `mirror_sign`: see `PosedLens`.
  LensFit(const Eigen::VectorXd& prior_deviations, double fine_rad, double mirror_sign,
          Executor& executor);

  /// A prior, and how far the parameters are from it.
  struct Parameters {
    State prior;
    Eigen::VectorXd offset;
  };
  /// Begins again at a prior.
  void restart(const State& prior);
  [[nodiscard]] const Parameters& parameters() const { return at_; }
  /// Continues from there.
  void set_parameters(const Parameters& parameters) { at_ = parameters; }

  /// Moves the parameters to the nearest minimum of `cost`; learns the deviation of a match.
  void solve(const std::vector<Match>& matches);
  /// Ends the lenses at these radii in pixels; false where the image's radius does not grow up to
  /// there.
  [[nodiscard]] bool set_max_angles(const std::array<double, 2>& radii_px);

  [[nodiscard]] State state() const { return apply_change(at_.prior, at_.offset); }
  /// Returns the standard deviation of a match.
  [[nodiscard]] double deviation_rad() const { return deviation_rad_; }
  /// Returns the covariance of all parameters for residuals that are correlated within a region
  /// (White's sandwich with clusters).
  [[nodiscard]] Eigen::MatrixXd covariance(const std::vector<Match>& matches) const;

 private:
  using Slopes = Eigen::Matrix<double, 2, 2 * (lens_size + rotation_size)>;
  class Linearised;
  class Problem;
  /// Returns the information of the matches about all parameters; `right`: where the cost falls.
  [[nodiscard]] Eigen::MatrixXd normal(const State& state, const std::vector<Match>& matches,
                                       Eigen::VectorXd& right) const;
  [[nodiscard]] double cost(const Eigen::VectorXd& offset, const std::vector<Match>& matches) const;
  /// Takes the deviation of a match from the median residual.
  void update_deviation(const std::vector<Match>& matches);

  Parameters at_;
  Eigen::VectorXd prior_information_;
  double fine_rad_;
  double mirror_sign_;
  Executor& executor_;
  double deviation_rad_ = 0.01;
};

}  // namespace panonav::dual_fisheye
