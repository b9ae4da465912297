#include "lab/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"

namespace panonav::lab {

namespace {

std::vector<double> compute_ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double shared_rank = 0.5 * static_cast<double>(begin + end - 1);
    for (std::size_t i = begin; i < end; ++i) result[order[i]] = shared_rank;
    begin = end;
  }
  return result;
}

std::pair<double, double> bootstrap_interval(std::span<const double> values, std::uint64_t seed,
                                             int samples,
                                             double (*statistic)(std::span<const double>)) {
  require(!values.empty(), "number of values", 0.0, ">= 1");
  require(samples >= 1, "bootstrap samples", samples, ">= 1");
  Random random(seed);
  std::vector<double> results;
  std::vector<double> drawn(values.size());
  for (int i = 0; i < samples; ++i) {
    for (auto& value : drawn) value = values[random.index(values.size())];
    results.push_back(statistic(drawn));
  }
  return {quantile(results, 0.025), quantile(results, 0.975)};
}

}  // namespace

Proportion success_rate(std::size_t successes, std::size_t trials) {
  require(trials >= 1, "trials", static_cast<double>(trials), ">= 1");
  require(successes <= trials, "successes", static_cast<double>(successes), "0 .. trials");
  constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n);
  // With no success or with successes only, one end of the interval is exactly 0 or 1.
  return {p, successes == 0 ? 0.0 : std::max(0.0, centre - half),
          successes == trials ? 1.0 : std::min(1.0, centre + half)};
}

std::pair<double, double> median_interval(std::span<const double> values, std::uint64_t seed,
                                          int samples) {
  return bootstrap_interval(values, seed, samples, median);
}

std::pair<double, double> mean_interval(std::span<const double> values, std::uint64_t seed,
                                        int samples) {
  return bootstrap_interval(values, seed, samples, mean);
}

double rank_correlation(std::span<const double> a, std::span<const double> b) {
  require(a.size() == b.size() && a.size() >= 3, "number of pairs", static_cast<double>(a.size()),
          ">= 3, the same for both");
  const auto rank_a = compute_ranks(a);
  const auto rank_b = compute_ranks(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (rank_a[i] - middle) * (rank_b[i] - middle);
    aa += (rank_a[i] - middle) * (rank_a[i] - middle);
    bb += (rank_b[i] - middle) * (rank_b[i] - middle);
  }
  // A set of equal values has no rank order to correlate.
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

Calibration::Calibration(std::vector<double> bin_starts) {
  for (const double start : bin_starts) bins_.push_back({.start = start});
  require(!bins_.empty() && bins_.front().start == 0.0, "bins", static_cast<double>(bins_.size()),
          ">= 1, the first from 0");
}

void Calibration::add(double probability, bool is_right) {
  require(probability >= 0.0 && probability <= 1.0, "probability", probability, "0 .. 1");
  Bin& bin = *(std::ranges::upper_bound(bins_, probability, {}, &Bin::start) - 1);
  bin.stated += probability;
  bin.right += is_right ? 1.0 : 0.0;
  ++bin.count;
}

std::size_t Calibration::count() const {
  std::size_t sum = 0;
  for (const Bin& bin : bins_) sum += bin.count;
  return sum;
}

double Calibration::error() const {
  if (count() == 0) return 0.0;
  double sum = 0.0;
  for (const Bin& bin : bins_) sum += std::abs(bin.stated - bin.right);
  return sum / static_cast<double>(count());
}

std::string Calibration::describe() const {
  std::string text;
  for (const Bin& bin : bins_) {
    if (bin.count == 0) continue;
    const auto answers = static_cast<double>(bin.count);
    text += (text.empty() ? "stated " : ", ") + format_fixed(bin.stated / answers, 2) + ": " +
            format_fixed(bin.right / answers, 2) + " right of " + std::to_string(bin.count);
  }
  return text;
}

}  // namespace panonav::lab
