#pragma once

#include <span>
#include <vector>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Sum over rows and k < components of |A^a - A^b| [M04 eq. 2, magnitudes]. components 0: all.
/// Throws ContractError on different shapes. Sums run in a fixed order.
[[nodiscard]] double dissimilarity_l1(const FourierSignature& a, const FourierSignature& b,
                                      int components = 0);
/// Computes the square root of the sum of squared differences of magnitudes [F11 eq. 2].
[[nodiscard]] double dissimilarity_l2(const FourierSignature& a, const FourierSignature& b,
                                      int components = 0);
/// Computes the sum of alpha_k |A^a - A^b| [M04 eq. 6]; one weight >= 0 per component; the first
/// weights.size() components are used.
[[nodiscard]] double dissimilarity_weighted(const FourierSignature& a, const FourierSignature& b,
                                            std::span<const double> weights);
/// Computes the L1 distance of packed magnitudes exactly, in integers; visual memories rank places
/// by this measure.
[[nodiscard]] std::uint32_t dissimilarity_packed(const PackedSignature& a, const PackedSignature& b,
                                                 int components = 0);

/// Rescales dissimilarities linearly: the largest becomes 0, the smallest 1000 [M04 eq. 3]. If all
/// are equal, all become 1000.
[[nodiscard]] std::vector<double> similarities(std::span<const double> dissimilarities);

}  // namespace panonav
