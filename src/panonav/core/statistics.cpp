#include "panonav/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

double interpolate_quantile(std::span<const double> sorted, double fraction) {
  const double position = fraction * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = position - static_cast<double>(below);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

}  // namespace

double quantile(std::span<const double> values, double fraction) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(fraction >= 0.0 && fraction <= 1.0, "fraction", fraction, "0 .. 1");
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return interpolate_quantile(sorted, fraction);
}

double median(std::span<const double> values) {
  return quantile(values, 0.5);
}

std::vector<float> gaussian_weights(double deviation) {
  require(std::isfinite(deviation) && deviation > 0.0, "deviation", deviation, "> 0");
  const int reach = static_cast<int>(std::ceil(2.5 * deviation));
  std::vector<float> weights;
  float sum = 0.0F;
  for (int d = -reach; d <= reach; ++d) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * d * d / (deviation * deviation))));
    sum += weights.back();
  }
  for (float& weight : weights) weight /= sum;
  return weights;
}

double mean(std::span<const double> values) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double order_statistic(std::vector<double> values, double fraction) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(fraction >= 0.0 && fraction <= 1.0, "fraction", fraction, "0 .. 1");
  const auto position = values.begin() + static_cast<std::ptrdiff_t>(
                                             fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), position, values.end());
  return *position;
}

}  // namespace panonav
