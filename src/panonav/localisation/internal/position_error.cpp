#include "panonav/localisation/internal/position_error.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

void PositionError::move(const Pose2& step) {
  const double x = error_per_scale_m_.x_m + step.x_m;
  const double y = error_per_scale_m_.y_m + step.y_m;
  const double cosine = std::cos(step.heading_rad);
  const double sine = std::sin(step.heading_rad);
  error_per_scale_m_ = {cosine * x + sine * y, cosine * y - sine * x};
}

void PositionError::begin(double variance_after_m2) {
  last_ = {variance_after_m2, variance_after_m2, variance_after_m2};
  error_per_scale_m_ = {};
}

void PositionError::observe(double variance_before_m2, double variance_after_m2, double exponent,
                            double correlation, double effective) {
  const double ratio = variance_before_m2 > 0.0 ? variance_after_m2 / variance_before_m2 : 1.0;
  const double kept = std::min(1.0, ratio);
  const double gain = 1.0 - kept;
  // A view that moves the particles to another place increases their variance; the error variance
  // grows by the same ratio.
  const double error_m2 = variance_at(variance_before_m2) * std::max(1.0, ratio);
  const double with_view_m2 = last_ ? correlation * last_->of_error_and_view_m2 : 0.0;
  // The particles imply the variance after / gain for the weakened view, so the whole view has the
  // variance exponent * after / gain.
  last_ = {variance_after_m2,
           kept * kept * error_m2 + gain * exponent * variance_after_m2 +
               2.0 * kept * gain * with_view_m2 + variance_after_m2 / effective,
           kept * with_view_m2 + exponent * variance_after_m2};
  error_per_scale_m_ = {kept * error_per_scale_m_.x_m, kept * error_per_scale_m_.y_m};
}

double PositionError::variance_at(double particle_variance_m2) const {
  if (!last_ || !(last_->of_particles_m2 > 0.0)) return particle_variance_m2;
  // Odometry adds the same variance to the particles and to the error.
  if (particle_variance_m2 >= last_->of_particles_m2) {
    return last_->of_error_m2 + particle_variance_m2 - last_->of_particles_m2;
  }
  return last_->of_error_m2 * particle_variance_m2 / last_->of_particles_m2;
}

std::array<double, 9> PositionError::corrected_covariance(std::array<double, 9> particles,
                                                          double heading_rad,
                                                          double translation_scale_error) const {
  std::array<double, 9> covariance = particles;
  const double particle_variance_m2 = particles[0] + particles[4];
  if (particle_variance_m2 > 0.0) {
    const double ratio = variance_at(particle_variance_m2) / particle_variance_m2;
    for (const std::size_t i : {0U, 1U, 3U, 4U}) covariance[i] *= ratio;
    for (const std::size_t i : {2U, 5U, 6U, 7U}) covariance[i] *= std::sqrt(ratio);
  }
  const double cosine = std::cos(heading_rad) * translation_scale_error;
  const double sine = std::sin(heading_rad) * translation_scale_error;
  const double x = cosine * error_per_scale_m_.x_m - sine * error_per_scale_m_.y_m;
  const double y = sine * error_per_scale_m_.x_m + cosine * error_per_scale_m_.y_m;
  covariance[0] += x * x;
  covariance[1] += x * y;
  covariance[3] += x * y;
  covariance[4] += y * y;
  return covariance;
}

}  // namespace panonav
