#include "panonav/localisation/internal/place_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Share of the answers that are wrong whatever their probability: of 161 narrow pictures with a
/// probability above 0.8, four were taken elsewhere (docs/experiments.md).
constexpr double min_unexplained = 0.025;
/// Radius that contains 95 % of a normal distribution in two dimensions, in deviations.
constexpr double radius_in_deviations = 2.4477;
/// Standard deviation of a heading: most errors are below 2 degrees, those of wrong pairs of
/// features reach 10.
constexpr double heading_deviation_rad = radians(5.0);

double normal_density(double squared_deviations, double deviation) {
  return std::exp(-0.5 * squared_deviations) / (std::sqrt(2.0 * std::numbers::pi) * deviation);
}

}  // namespace

PlaceLikelihood::PlaceLikelihood(const Place& place, std::size_t views, double spacing_m,
                                 bool compass)
    : area_m2_(static_cast<double>(views) * spacing_m * spacing_m), compass_(compass) {
  add(place.probability, place.position, place.heading_rad, spacing_m);
  for (const AlternativePlace& other : place.alternatives) {
    add(other.probability, other.position, other.heading_rad, spacing_m);
  }
  // The radius of the first one may reach to the others (`Place::position`), which stand here for
  // themselves.
  double explained = 0.0;
  for (Part& part : parts_) {
    explained += part.share;
    part.deviation_m = std::min(part.deviation_m, parts_.back().deviation_m);
  }
  unexplained_ = std::max(min_unexplained, 1.0 - explained);
}

void PlaceLikelihood::add(double share, const std::optional<PositionEstimate>& position,
                          const std::optional<double>& heading_rad, double spacing_m) {
  if (!position || !(share > 0.0)) return;
  const double radius_m = position->radius_m.value_or(radius_in_deviations * spacing_m);
  parts_.push_back({share, position->position(), heading_rad,
                    std::max(radius_m / radius_in_deviations, 0.1 * spacing_m)});
}

double PlaceLikelihood::log_ratio(const Pose2& pose) const {
  double ratio = unexplained_;
  for (const Part& part : parts_) {
    const double x = (pose.x_m - part.position.x_m) / part.deviation_m;
    const double y = (pose.y_m - part.position.y_m) / part.deviation_m;
    double density = area_m2_ * normal_density(x * x, part.deviation_m) *
                     normal_density(y * y, part.deviation_m);
    if (compass_ && part.heading_rad) {
      const double turn =
          angle_difference(pose.heading_rad, *part.heading_rad) / heading_deviation_rad;
      density *= 2.0 * std::numbers::pi * normal_density(turn * turn, heading_deviation_rad);
    }
    ratio += part.share * density;
  }
  return std::log(ratio);
}

void PlaceLikelihood::compute_log_ratios(const Particles& particles, std::span<double> ratios) {
  for (std::size_t i = 0; i < particles.size(); ++i) ratios[i] = log_ratio(particles.pose(i));
}

Pose2 PlaceLikelihood::sample(Random& random) const {
  double total = 0.0;
  for (const Part& part : parts_) total += part.share;
  double mark = random.uniform(0.0, total);
  std::size_t chosen = 0;
  while (chosen + 1 < parts_.size() && mark >= parts_[chosen].share) mark -= parts_[chosen++].share;
  const Part& part = parts_[chosen];
  const double heading_rad = part.heading_rad
                                 ? random.normal(*part.heading_rad, heading_deviation_rad)
                                 : random.uniform(-std::numbers::pi, std::numbers::pi);
  return {random.normal(part.position.x_m, part.deviation_m),
          random.normal(part.position.y_m, part.deviation_m), wrap_angle(heading_rad)};
}

}  // namespace panonav
