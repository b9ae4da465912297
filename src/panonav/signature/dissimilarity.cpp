#include "panonav/signature/dissimilarity.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Returns the number of leading magnitudes to compare: all rows of the first `components` (0: of
/// all). Throws ContractError on different shapes.
std::size_t count_compared_magnitudes(SignatureShape a, SignatureShape b, int components) {
  if (a != b) {
    throw ContractError("signature of " + std::to_string(a.rows) + " rows x " +
                            std::to_string(a.components) + " components compared with one",
                        "of " + std::to_string(b.rows) + " x " + std::to_string(b.components),
                        "the same shape");
  }
  require(components >= 0 && components <= a.components, "components", components,
          "0 (all) .. " + std::to_string(a.components));
  return static_cast<std::size_t>(components == 0 ? a.components : components) * a.rows;
}

}  // namespace

double dissimilarity_l1(const FourierSignature& a, const FourierSignature& b, int components) {
  const std::size_t count = count_compared_magnitudes(a.shape(), b.shape(), components);
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += std::abs(static_cast<double>(a.magnitudes()[i]) - b.magnitudes()[i]);
  }
  return sum;
}

double dissimilarity_l2(const FourierSignature& a, const FourierSignature& b, int components) {
  const std::size_t count = count_compared_magnitudes(a.shape(), b.shape(), components);
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double difference = static_cast<double>(a.magnitudes()[i]) - b.magnitudes()[i];
    sum += difference * difference;
  }
  return std::sqrt(sum);
}

double dissimilarity_weighted(const FourierSignature& a, const FourierSignature& b,
                              std::span<const double> weights) {
  require(!weights.empty() && weights.size() <= static_cast<std::size_t>(a.components()),
          "number of weights", static_cast<double>(weights.size()),
          "1 .. " + std::to_string(a.components()) + " (one per component)");
  count_compared_magnitudes(a.shape(), b.shape(), 0);
  double sum = 0.0;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    require(weights[k] >= 0.0 && std::isfinite(weights[k]), "weight", weights[k], "finite, >= 0");
    double component_sum = 0.0;
    for (std::size_t i = k * a.rows(); i < (k + 1) * a.rows(); ++i) {
      component_sum += std::abs(static_cast<double>(a.magnitudes()[i]) - b.magnitudes()[i]);
    }
    sum += weights[k] * component_sum;
  }
  return sum;
}

std::uint32_t dissimilarity_packed(const PackedSignature& a, const PackedSignature& b,
                                   int components) {
  const std::size_t count = count_compared_magnitudes(a.shape, b.shape, components);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum +=
        static_cast<std::uint32_t>(std::abs(static_cast<int>(a.magnitudes[i]) - b.magnitudes[i]));
  }
  return sum;
}

std::vector<double> similarities(std::span<const double> dissimilarities) {
  std::vector<double> result(dissimilarities.size(), 1000.0);
  if (dissimilarities.empty()) return result;
  for (const double value : dissimilarities) {
    require(std::isfinite(value), "dissimilarity", value, "finite");
  }
  const auto [low, high] = std::ranges::minmax(dissimilarities);
  if (low == high) return result;
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = 1000.0 * (high - dissimilarities[i]) / (high - low);
  }
  return result;
}

}  // namespace panonav
