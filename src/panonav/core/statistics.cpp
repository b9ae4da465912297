#include "panonav/core/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {

namespace {

double quantile_of_sorted(std::span<const double> sorted, double fraction) {
  const double position = fraction * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = position - static_cast<double>(below);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double shared = 0.5 * static_cast<double>(begin + end - 1);
    for (std::size_t i = begin; i < end; ++i) result[order[i]] = shared;
    begin = end;
  }
  return result;
}

template <class Statistic>
std::pair<double, double> bootstrap_interval(std::span<const double> values, std::uint64_t seed,
                                             int samples, const Statistic& statistic) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(samples >= 1, "bootstrap samples", samples, ">= 1");
  Random random(seed);
  std::vector<double> results;
  std::vector<double> drawn(values.size());
  for (int i = 0; i < samples; ++i) {
    for (auto& value : drawn) value = values[random.index(values.size())];
    results.push_back(statistic(drawn));
  }
  std::sort(results.begin(), results.end());
  return {quantile_of_sorted(results, 0.025), quantile_of_sorted(results, 0.975)};
}

}  // namespace

double quantile(std::span<const double> values, double fraction) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(fraction >= 0.0 && fraction <= 1.0, "fraction", fraction, "0 .. 1");
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return quantile_of_sorted(sorted, fraction);
}

double median(std::span<const double> values) {
  return quantile(values, 0.5);
}

double mean(std::span<const double> values) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double order_statistic(std::vector<double> values, double fraction) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(fraction >= 0.0 && fraction <= 1.0, "fraction", fraction, "0 .. 1");
  const auto place = values.begin() +
                     static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

Proportion success_rate(std::size_t successes, std::size_t trials) {
  require(trials >= 1, "trials", static_cast<double>(trials), ">= 1");
  require(successes <= trials, "successes", static_cast<double>(successes), "0 .. trials");
  constexpr double z = 1.959963984540054;
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n);
  // Exact where the interval ends with what can be.
  return {p, successes == 0 ? 0.0 : std::max(0.0, centre - half),
          successes == trials ? 1.0 : std::min(1.0, centre + half)};
}

std::pair<double, double> median_interval(std::span<const double> values, std::uint64_t seed,
                                          int samples) {
  return bootstrap_interval(values, seed, samples, [](std::vector<double>& drawn) {
    std::sort(drawn.begin(), drawn.end());
    return quantile_of_sorted(drawn, 0.5);
  });
}

std::pair<double, double> mean_interval(std::span<const double> values, std::uint64_t seed,
                                        int samples) {
  return bootstrap_interval(values, seed, samples,
                            [](const std::vector<double>& drawn) { return mean(drawn); });
}

double rank_correlation(std::span<const double> a, std::span<const double> b) {
  require(a.size() == b.size() && a.size() >= 3, "number of pairs", static_cast<double>(a.size()),
          ">= 3, the same for both");
  const auto rank_a = ranks(a);
  const auto rank_b = ranks(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (rank_a[i] - middle) * (rank_b[i] - middle);
    aa += (rank_a[i] - middle) * (rank_a[i] - middle);
    bb += (rank_b[i] - middle) * (rank_b[i] - middle);
  }
  // One set without any spread has no ranks to correlate.
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

}  // namespace panonav
