#include "panonav/relative_pose/internal/coherence_weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "panonav/core/portable_math.hpp"

namespace panonav {

namespace {

/// Correlation of both views in one component, and the energy of each.
struct Coherence {
  float common = 0.0F, home = 0.0F, current = 0.0F;
};
Coherence sum_coherence(PairCoefficients& c, int k, std::size_t rows) {
  const float* const ha = c.home_a(k);
  const float* const hb = c.home_b(k);
  const float* const ca = c.current_a(k);
  const float* const cb = c.current_b(k);
  Coherence sum;
  for (std::size_t y = 0; y < rows; ++y) {
    sum.common += ha[y] * ca[y] + hb[y] * cb[y];
    sum.home += ha[y] * ha[y] + hb[y] * hb[y];
    sum.current += ca[y] * ca[y] + cb[y] * cb[y];
  }
  return sum;
}

/// Fits the width of a Gaussian exp(-k^2 / (2 width^2)) to the coherences by least squares, with a
/// free factor: noise lowers all coherences, distance those of high frequencies first. The
/// coherences themselves are not used, as a single row shows little about each frequency.
PerFrequency fit_gaussian(const PerFrequency& coherences, int highest) {
  PerFrequency best{};
  double best_gain = -std::numeric_limits<double>::infinity();
  constexpr double min_width = 1.5;    // the first frequency has a weight of 0.8
  constexpr double width_step = 1.19;  // a quarter of an octave
  for (double width = min_width; width < 3.0 * highest; width *= width_step) {
    PerFrequency gaussian{};
    const double step = portable::exp(-0.5 / (width * width));
    double value = step;
    double ratio = step * step * step;  // step^(2 k + 1)
    double common = 0.0;
    double square = 0.0;
    for (int k = 1; k <= highest; ++k) {
      const auto i = static_cast<std::size_t>(k);
      gaussian[i] = value;
      common += value * coherences[i];
      square += value * value;
      value *= ratio;
      ratio *= step * step;
    }
    const double gain = common / std::sqrt(square);
    if (gain > best_gain) {
      best_gain = gain;
      best = gaussian;
    }
  }
  return best;
}

/// Divides the weights by the amplitudes of the components and keeps the sum of the weights.
/// `power`: mean of `powers`.
void whiten_weights(PerFrequency& weights, const PerFrequency& powers, double power, int highest) {
  if (!(power > 0.0)) return;
  constexpr double noise_share = 0.02;  // of the mean power: weaker components are mostly noise
  double before = 0.0;
  double after = 0.0;
  for (int k = 1; k <= highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    before += weights[i];
    weights[i] /= std::sqrt(powers[i] / power + noise_share);
    after += weights[i];
  }
  for (int k = 1; k <= highest; ++k) weights[static_cast<std::size_t>(k)] *= before / after;
}

}  // namespace

PerFrequency compute_component_weights(PairCoefficients& coefficients, int highest,
                                       std::size_t rows) {
  PerFrequency coherences{};
  PerFrequency powers{};
  double power = 0.0;
  for (int k = 1; k <= highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Coherence sum = sum_coherence(coefficients, k, rows);
    const float max_correlation = std::sqrt(sum.home) * std::sqrt(sum.current);
    if (max_correlation > 0.0F) {
      coherences[i] = static_cast<double>(sum.common / max_correlation);
    }
    powers[i] = static_cast<double>(sum.home + sum.current);
    power += powers[i] / highest;
  }
  PerFrequency weights = fit_gaussian(coherences, highest);
  whiten_weights(weights, powers, power, highest);
  return weights;
}

void compute_row_weights(PairCoefficients& coefficients, int highest, const PerFrequency& weights,
                         std::span<float> row_weights) {
  constexpr double min_weight = 0.05;  // no row is left out completely
  for (std::size_t y = 0; y < row_weights.size(); ++y) {
    double common = 0.0;
    double home = 0.0;
    double current = 0.0;
    for (int k = 1; k <= highest; ++k) {
      const double weight = weights[static_cast<std::size_t>(k)];
      const float ha = coefficients.home_a(k)[y];
      const float hb = coefficients.home_b(k)[y];
      const float ca = coefficients.current_a(k)[y];
      const float cb = coefficients.current_b(k)[y];
      common += weight * static_cast<double>(ha * ca + hb * cb);
      home += weight * static_cast<double>(ha * ha + hb * hb);
      current += weight * static_cast<double>(ca * ca + cb * cb);
    }
    const double max_correlation = std::sqrt(home) * std::sqrt(current);
    row_weights[y] = static_cast<float>(
        max_correlation > 0.0 ? std::clamp(common / max_correlation, min_weight, 1.0) : min_weight);
  }
}

}  // namespace panonav
