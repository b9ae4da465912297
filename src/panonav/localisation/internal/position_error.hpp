#pragma once

#include <array>
#include <optional>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Variance of a tracked position whose errors of successive views and of odometry are correlated,
/// where a particle filter takes them for independent (a consider filter; Schmidt 1966).
///
/// Near the truth the filter is a linear estimator: an image keeps the share K = after / before of
/// the particles' variance, and so of every earlier error. The view's own error is correlated with
/// that of the view before it as the views themselves are, exp(-distance driven / range); the scale
/// error of travel is constant; and particles are finitely many. Variances are of x and y together.
/// Does not move or weigh particles.
class PositionError {
 public:
  /// Takes a motion of the robot, robot_old_from_robot_new.
  void move(const Pose2& step);
  /// Starts with the variance of the particles after the first view, which decides alone.
  void begin(double variance_after_m2);
  /// Takes a view that counted by the exponent `share` of its likelihood, and whose error has this
  /// correlation with that of the one before. Variances of the particles before and after it, > 0;
  /// `effective`: their effective sample size, > 0.
  void observe(double variance_before_m2, double variance_after_m2, double share,
               double correlation, double effective);

  /// Returns the covariance of x, y (m) and heading (rad), row by row, of a robot with this heading
  /// whose particles have the covariance `particles`. `translation_scale_error` as `OdometryNoise`.
  [[nodiscard]] std::array<double, 9> corrected_covariance(std::array<double, 9> particles,
                                                           double heading_rad,
                                                           double translation_scale_error) const;

 private:
  // Returns the variance of the random errors when the particles' is `particle_variance_m2`.
  [[nodiscard]] double variance_at(double particle_variance_m2) const;

  struct Variances {
    double of_particles_m2;
    double of_error_m2;
    double of_error_and_view_m2;  // covariance of the error and the last view's own
  };
  std::optional<Variances> last_;  // after the last view; nullopt before the first
  // Error for each unit of relative scale error of travel, in the robot's frame.
  Point2 per_scale_m_;
};

}  // namespace panonav
