#include "panonav/localisation/internal/resampling.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

double effective_sample_size(std::span<const double> weights) {
  double sum = 0.0;
  double squares = 0.0;
  for (const double weight : weights) {
    sum += weight;
    squares += weight * weight;
  }
  return squares > 0.0 ? sum * sum / squares : 0.0;
}

std::vector<std::size_t> resample_systematically(std::span<const double> weights, std::size_t count,
                                                 Random& random) {
  double sum = 0.0;
  for (const double weight : weights) {
    require(std::isfinite(weight) && weight >= 0.0, "weight of a particle", weight, ">= 0");
    sum += weight;
  }
  require(sum > 0.0, "sum of the weights", sum, "> 0");
  std::vector<std::size_t> survivors;
  survivors.reserve(count);
  const double step = sum / static_cast<double>(count);
  const double offset = random.uniform();
  std::size_t i = 0;
  double passed = weights[0];
  for (std::size_t mark = 0; mark < count; ++mark) {
    const double position = (static_cast<double>(mark) + offset) * step;
    // By rounding, the last mark may exceed the sum.
    while (position >= passed && i + 1 < weights.size()) passed += weights[++i];
    survivors.push_back(i);
  }
  return survivors;
}

void resample_particles(Particles& particles, std::size_t count, Random& random) {
  const auto survivors = resample_systematically(particles.weight, count, random);
  Particles next;
  next.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    next.set(i, particles.pose(survivors[i]), 1.0 / static_cast<double>(count));
  }
  particles = std::move(next);
}

void resample_and_spread(Particles& particles, const PoseBins& bins, Random& random) {
  const std::size_t count = particles.size();
  const auto survivors = resample_systematically(particles.weight, count, random);
  const ParticleModes found = find_modes(particles, bins);
  std::vector<std::size_t> members(found.modes.size());
  for (const std::size_t s : survivors) {
    if (found.mode_of[s] >= 0) ++members[static_cast<std::size_t>(found.mode_of[s])];
  }
  Particles next;
  next.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t s = survivors[i];
    Pose2 pose = particles.pose(s);
    if (found.mode_of[s] >= 0) {
      // Width of the kernel with the smallest mean squared error for a normal distribution in three
      // dimensions (Silverman 1986, eq. 4.14 and table 4.1: exponent 1 / (d + 4), factor (4 / (d +
      // 2))).
      const auto m = static_cast<std::size_t>(found.mode_of[s]);
      const PoseMode& mode = found.modes[m];
      const double width =
          std::pow(0.8 / static_cast<double>(std::max<std::size_t>(1, members[m])), 1.0 / 7.0);
      const auto [x, y] = random.normal_pair();
      pose.x_m += x * width * std::sqrt(mode.covariance[0]);
      pose.y_m += y * width * std::sqrt(mode.covariance[4]);
      pose.heading_rad =
          wrap_angle(pose.heading_rad + random.normal(0.0, width * std::sqrt(mode.covariance[8])));
    }
    next.set(i, pose, 1.0 / static_cast<double>(count));
  }
  particles = std::move(next);
}

std::size_t kld_sample_size(std::size_t occupied_bins, double error) {
  require(error > 0.0, "allowed error", error, "> 0");
  if (occupied_bins <= 1) return 1;
  constexpr double normal_quantile = 2.3263478740408408;  // of 0.99
  const double freedom = static_cast<double>(occupied_bins - 1);
  const double part = 2.0 / (9.0 * freedom);
  const double root = 1.0 - part + std::sqrt(part) * normal_quantile;
  return static_cast<std::size_t>(std::ceil(freedom / (2.0 * error) * root * root * root));
}

}  // namespace panonav
