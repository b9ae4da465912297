#pragma once

#include <array>
#include <optional>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Estimates the variance of a tracked position whose errors of successive views and of odometry
/// are correlated. A particle filter takes these errors for independent (a consider filter; Schmidt
/// 1966).
///
/// Near the true position the filter is a linear estimator: an image multiplies the particles'
/// variance, and each earlier error, by K = variance after / variance before. Successive views' own
/// errors have the correlation exp(-distance driven / range); the scale error of travel is
/// constant; and the number of particles is finite. Variances are the sum of x and y. Does not move
/// particles or change weights.
class PositionError {
 public:
  /// Adds a motion of the robot, robot_old_from_robot_new.
  void move(const Pose2& step);
  /// Restarts with the particles' variance after the first view, the only source of error so far.
  void begin(double variance_after_m2);
  /// Adds a view whose likelihood was raised to the power of `exponent`. `correlation`: of its
  /// error with that of the previous view. Variances of the particles before and after the view, >
  /// 0; `effective`: effective sample size, > 0.
  void observe(double variance_before_m2, double variance_after_m2, double exponent,
               double correlation, double effective);

  /// Returns the covariance of x, y (m) and heading (rad), row by row, of the robot's pose error.
  /// `particles`: covariance of the particles; `heading_rad`: of the robot;
  /// `translation_scale_error`: as in `OdometryNoise`.
  [[nodiscard]] std::array<double, 9> corrected_covariance(std::array<double, 9> particles,
                                                           double heading_rad,
                                                           double translation_scale_error) const;

 private:
  // Returns the variance of the random position errors if the particles have this variance.
  [[nodiscard]] double variance_at(double particle_variance_m2) const;

  struct Variances {
    double of_particles_m2;
    double of_error_m2;
    double of_error_and_view_m2;  // covariance of the error with that of the last view
  };
  std::optional<Variances> last_;  // after the last view; nullopt before the first
  // Position error per unit of relative scale error of odometry, in the robot's frame.
  Point2 error_per_scale_m_;
};

}  // namespace panonav
