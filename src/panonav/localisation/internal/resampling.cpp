#include "panonav/localisation/internal/resampling.hpp"

#include <cmath>
#include <string>

#include "panonav/core/error.hpp"

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

std::vector<std::size_t> low_variance_resample(std::span<const double> weights, std::size_t count,
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
    // Rounding may leave the last mark beyond the sum.
    while (position >= passed && i + 1 < weights.size()) passed += weights[++i];
    survivors.push_back(i);
  }
  return survivors;
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
