#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace panonav {

/// Residuals farther apart, as a share of a closed line, are taken as independent: 10 degrees; 5
/// and 20 do as well (decisions.md).
constexpr double correlated_share = 10.0 / 360.0;

/// Returns the variance of a sum of the values of a closed line over that of as many independent
/// ones, at least 1: the sum of their autocorrelations up to `reach`, a share of the line, with
/// Bartlett's window [Newey and West, Econometrica 1987]. 1 if all values are 0.
[[nodiscard]] inline double autocorrelation_factor(std::span<const double> values, double reach) {
  const auto lags = static_cast<std::size_t>(reach * static_cast<double>(values.size()));
  const auto correlate = [&](std::size_t lag) {
    double sum = 0.0;
    for (std::size_t c = 0; c < values.size(); ++c)
      sum += values[c] * values[(c + lag) % values.size()];
    return sum;
  };
  const double squares = correlate(0);
  if (!(squares > 0.0)) return 1.0;
  double sum = squares;
  for (std::size_t lag = 1; lag <= lags; ++lag) {
    const double window = 1.0 - static_cast<double>(lag) / (static_cast<double>(lags) + 1.0);
    sum += 2.0 * window * correlate(lag);
  }
  return std::max(1.0, sum / squares);
}

}  // namespace panonav
