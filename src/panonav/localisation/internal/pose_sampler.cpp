#include "panonav/localisation/internal/pose_sampler.hpp"

#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Standard deviation of new particles' positions in spacings; 79 % of the values of a coordinate
/// lie in the grid square of the reference.
constexpr double position_deviation_spacings = 0.4;
/// Standard deviation of new particles' headings as a share of `heading_width_rad`, so that nearly
/// all are within the width.
constexpr double heading_deviation_widths = 0.25;

/// Returns the heading of a random particle, for new particles without a heading by the compass.
double sample_heading(const Particles& particles, Random& random) {
  return particles.heading_rad[random.index(particles.size())];
}

}  // namespace

bool PoseSampler::has_heading(std::uint32_t site) const {
  return compass_ && !std::isnan(likelihood_->sites()[site].heading_rad);
}

Pose2 PoseSampler::make_pose_at(Candidate candidate, const Particles& particles,
                                Random& random) const {
  const auto& site = likelihood_->sites()[candidate.site];
  const double heading_rad =
      has_heading(candidate.site)
          ? static_cast<double>(candidate.second_heading ? site.other_heading_rad
                                                         : site.heading_rad)
          : sample_heading(particles, random);
  return {site.position.x_m, site.position.y_m, wrap_angle(heading_rad)};
}

Pose2 PoseSampler::sample_around(Candidate candidate, const Particles& particles,
                                 Random& random) const {
  Pose2 pose = make_pose_at(candidate, particles, random);
  pose.x_m += random.normal(0.0, position_deviation_spacings * model_->spacing_m);
  pose.y_m += random.normal(0.0, position_deviation_spacings * model_->spacing_m);
  if (has_heading(candidate.site)) {
    pose.heading_rad =
        wrap_angle(pose.heading_rad +
                   random.normal(0.0, heading_deviation_widths * model_->heading_width_rad));
  }
  return pose;
}

Pose2 PoseSampler::sample_in_square(std::size_t site, std::optional<double> heading_rad,
                                    Random& random) const {
  const Point2 centre = likelihood_->sites()[site].position;
  const double half = 0.5 * model_->spacing_m;
  const double x = centre.x_m + random.uniform(-half, half);
  const double y = centre.y_m + random.uniform(-half, half);
  const double any_heading_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  return {x, y, heading_rad.value_or(any_heading_rad)};
}

Pose2 PoseSampler::sample_anywhere(const Particles& particles, Random& random) const {
  const double borrowed_rad = sample_heading(particles, random);
  const std::size_t site = random.index(likelihood_->sites().size());
  return sample_in_square(site, compass_ ? std::nullopt : std::optional(borrowed_rad), random);
}

}  // namespace panonav
