#include "panonav/route/internal/line_sampling.hpp"

#include <algorithm>

namespace panonav {

std::vector<float> smoothed_line(std::span<const float> line, double sigma) {
  if (sigma < 0.3 || line.empty()) return {line.begin(), line.end()};
  const auto reach = static_cast<std::size_t>(std::ceil(3.0 * sigma));
  std::vector<float> kernel(reach + 1);
  float sum = 0.0F;
  for (std::size_t k = 0; k <= reach; ++k) {
    const double off = static_cast<double>(k) / sigma;
    kernel[k] = static_cast<float>(std::exp(-0.5 * off * off));
    sum += (k == 0 ? 1.0F : 2.0F) * kernel[k];
  }
  for (float& weight : kernel) weight /= sum;
  // Continued beyond both ends, so that the loops below have no wrap.
  std::vector<float> closed(line.size() + 2 * reach);
  for (std::size_t i = 0; i < closed.size(); ++i) {
    closed[i] = line[(i + line.size() - reach % line.size()) % line.size()];
  }
  std::vector<float> result(line.size());
  for (std::size_t c = 0; c < line.size(); ++c) result[c] = kernel[0] * closed[c + reach];
  for (std::size_t k = 1; k <= reach; ++k) {
    const float* const left = closed.data() + reach - k;
    const float* const right = closed.data() + reach + k;
    for (std::size_t c = 0; c < line.size(); ++c) result[c] += kernel[k] * (left[c] + right[c]);
  }
  return result;
}

}  // namespace panonav
