#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
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

/// The same of a copy.
template <typename Value>
[[nodiscard]] Value upper_median(std::vector<Value> values) {
  return upper_median_in_place(std::span(values));
}

/// The value of `values` that stands at `fraction` (0 .. 1) of the way through them in ascending
/// order, rounded down: one of them, where `quantile` interpolates. Throws ContractError on no
/// values. Cost: O(n).
[[nodiscard]] double order_statistic(std::vector<double> values, double fraction);

/// A share of trials and how certain it is.
struct Proportion {
  double value = 0.0;  ///< successes / trials, 0 .. 1
  double low = 0.0;    ///< of the 95 % Wilson score interval
  double high = 0.0;   ///< of the same interval; exactly 1 where every trial succeeded
};
/// Throws ContractError unless 0 <= successes <= trials and trials >= 1.
[[nodiscard]] Proportion success_rate(std::size_t successes, std::size_t trials);

/// 95 % percentile bootstrap interval of the median. Same seed, same bits.
[[nodiscard]] std::pair<double, double> median_interval(std::span<const double> values,
                                                        std::uint64_t seed, int samples = 1000);

/// The same of the mean. For figures per scene: the scenes are what is drawn.
[[nodiscard]] std::pair<double, double> mean_interval(std::span<const double> values,
                                                      std::uint64_t seed, int samples = 1000);

/// Spearman's rank correlation, -1 .. 1; ties share their mean rank. Throws ContractError on
/// different sizes or fewer than 3.
[[nodiscard]] double rank_correlation(std::span<const double> a, std::span<const double> b);

}  // namespace panonav
