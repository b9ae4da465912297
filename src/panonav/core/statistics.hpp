#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// Linear interpolation between order statistics; `fraction` in [0, 1]. Throws ContractError on no
/// values.
[[nodiscard]] double quantile(std::span<const double> values, double fraction);
/// The middle value; of an even number the mean of the two in the middle. Throws ContractError on
/// no values. Cost: O(n log n).
[[nodiscard]] double median(std::span<const double> values);
/// Arithmetic mean. Throws ContractError on no values.
[[nodiscard]] double mean(std::span<const double> values);

/// The median; of an even number the larger of the two in the middle. Reorders `values`, of which
/// there must be at least one. Cost: O(n).
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

/// The value at `fraction` (0 .. 1) of the ascending order, its position rounded down: one of the
/// values, where `quantile` interpolates. Throws ContractError on no
/// values. Cost: O(n).
[[nodiscard]] double order_statistic(std::vector<double> values, double fraction);

}  // namespace panonav
