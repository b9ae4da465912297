#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace panonav::lab {

/// A success rate with its confidence interval.
struct Proportion {
  double value = 0.0;  ///< successes / trials, 0 .. 1
  double low = 0.0;    ///< of the 95 % Wilson score interval
  double high = 0.0;   ///< of the same; exactly 1 if all trials succeeded
};
/// Computes a success rate with its Wilson interval. Throws ContractError unless 0 <= successes <=
/// trials and trials >= 1.
[[nodiscard]] Proportion success_rate(std::size_t successes, std::size_t trials);

/// Returns the 95 % percentile bootstrap interval of the median. The same seed gives the same bits.
[[nodiscard]] std::pair<double, double> median_interval(std::span<const double> values,
                                                        std::uint64_t seed, int samples = 1000);

/// Returns the 95 % percentile bootstrap interval of the mean. The same seed gives the same bits.
[[nodiscard]] std::pair<double, double> mean_interval(std::span<const double> values,
                                                      std::uint64_t seed, int samples = 1000);

/// Returns Spearman's rank correlation, -1 .. 1; ties share their mean rank. 0 if all values of one
/// set are equal. Throws ContractError on different sizes or fewer than 3 values.
[[nodiscard]] double rank_correlation(std::span<const double> a, std::span<const double> b);

}  // namespace panonav::lab
