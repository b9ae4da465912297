#pragma once

#include <array>
#include <optional>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// How uncertain a tracked position is when the errors of successive views and of odometry are
/// alike, which a particle filter takes for independent.
///
/// The filter is followed as the linear estimator that it is near the truth (a consider filter;
/// Schmidt 1966): an image keeps the share K = after / before of the particles' variance, and so of
/// every error made before. The view's own error resembles that of the view before it as far as the
/// views themselves do, exp(-distance driven / range); the scale error of travel is the same all
/// the time; and particles are finitely many. Variances are of x and y together. Nothing of this
/// moves or weighs a particle.
class PositionError {
 public:
  /// The robot moved by `step`, robot_old_from_robot_new.
  void move(const Pose2& step);
  /// The first view decides alone: variance of the particles after it.
  void begin(double after_m2);
  /// A view counted by the exponent `share` of its likelihood, and resembles the one before as
  /// `correlation` says. Variances of the particles before and after it, > 0; `effective`: of them,
  /// > 0.
  void observe(double before_m2, double after_m2, double share, double correlation,
               double effective);

  /// The covariance of x, y (m) and heading (rad), row by row, of a robot with this heading whose
  /// particles have the covariance `particles`. `translation_scale_error` as `OdometryNoise`.
  [[nodiscard]] std::array<double, 9> stated(std::array<double, 9> particles, double heading_rad,
                                             double translation_scale_error) const;

 private:
  // Variance of the random errors when the particles' is `particles_m2`.
  [[nodiscard]] double variance_at(double particles_m2) const;

  struct Variances {
    double of_particles_m2;
    double of_error_m2;
    double of_error_and_view_m2;  // covariance of the error and the last view's own
  };
  std::optional<Variances> last_;  // after the last view; empty: none yet
  // Error for each unit of relative error of travel, in the robot's frame.
  Point2 per_scale_m_;
};

}  // namespace panonav
