#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

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

/// Compares stated probabilities with the share of answers that are right, in bins.
class Calibration {
 public:
  /// `bin_starts`: smallest probability of each bin, ascending, the first 0.
  explicit Calibration(std::vector<double> bin_starts = {0.0, 0.2, 0.4, 0.6, 0.8});

  /// Counts one answer. Throws ContractError unless `probability` is in 0 .. 1.
  void add(double probability, bool is_right);
  [[nodiscard]] std::size_t count() const;
  /// Returns the mean difference between stated and right, weighted by the answers of each bin; 0
  /// without answers.
  [[nodiscard]] double error() const;
  /// Describes each bin that has answers: "stated 0.52: 0.50 right of 8, 0.91: 0.92 right of 60".
  [[nodiscard]] std::string describe() const;

 private:
  struct Bin {
    double start = 0.0;
    double stated = 0.0;  // sum
    double right = 0.0;
    std::size_t count = 0;
  };
  std::vector<Bin> bins_;
};

}  // namespace panonav::lab
