#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// Computes a quantile by linear interpolation between order statistics; `fraction` in [0, 1].
/// Throws ContractError on no values.
[[nodiscard]] double quantile(std::span<const double> values, double fraction);
/// Computes the median; for an even number of values the mean of the two in the middle. Throws
/// ContractError on no values. Cost: O(n log n).
[[nodiscard]] double median(std::span<const double> values);
/// Returns the weights of a Gaussian at whole numbers up to 2.5 deviations on both sides of 0, with
/// the sum 1. Throws ContractError unless `deviation` is finite and > 0.
[[nodiscard]] std::vector<float> gaussian_weights(double deviation);
/// Arithmetic mean. Throws ContractError on no values.
[[nodiscard]] double mean(std::span<const double> values);

/// Computes the median; for an even number of values the larger of the two in the middle. Reorders
/// `values`, which must not be empty. Cost: O(n).
template <typename Value>
[[nodiscard]] Value upper_median_in_place(std::span<Value> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The upper median of a copy.
template <typename Value>
[[nodiscard]] Value upper_median(std::vector<Value> values) {
  return upper_median_in_place(std::span(values));
}

/// Returns the value at the position fraction * (n - 1), rounded down, of the ascending order.
/// Unlike `quantile` it does not interpolate. Throws ContractError on no values. Cost: O(n).
[[nodiscard]] double order_statistic(std::vector<double> values, double fraction);

}  // namespace panonav
