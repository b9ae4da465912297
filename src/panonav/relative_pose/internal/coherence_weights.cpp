#include "panonav/relative_pose/internal/coherence_weights.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

namespace panonav {

PerFrequency fitted_gaussian(const PerFrequency& coherences, int highest) {
  PerFrequency best{};
  double most = -std::numeric_limits<double>::infinity();
  for (double width = 1.5; width < 3.0 * highest; width *= 1.19) {
    PerFrequency gaussian{};
    const double step = std::exp(-0.5 / (width * width));
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
    if (gain > most) {
      most = gain;
      best = gaussian;
    }
  }
  return best;
}

void over_amplitude(PerFrequency& weights, const PerFrequency& powers, double power, int highest) {
  if (!(power > 0.0)) return;
  constexpr double faint = 0.02;  // of the mean: fainter ones are mostly noise
  double before = 0.0;
  double after = 0.0;
  for (int k = 1; k <= highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    before += weights[i];
    weights[i] /= std::sqrt(powers[i] / power + faint);
    after += weights[i];
  }
  for (int k = 1; k <= highest; ++k) weights[static_cast<std::size_t>(k)] *= before / after;
}

}  // namespace panonav
