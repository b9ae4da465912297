#pragma once

#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes the share of a view's squared similarity to nearby references that each pose explains:
/// (sum similarity expected)^2 / sum expected^2 with expected = exp(-sqrt(distance^2 + blur) *
/// per_metre), where each similarity counts exp(turn^2 per_square_turn), turn being the difference
/// of the pose's heading from the heading that the reference implies; of its two headings the one
/// of the larger weight. Spans of one size; throws ContractError otherwise. All instruction sets
/// give the same bits. Cost: about 5 ns a pose with AVX-512; sixteen poses cost as much as one.
void explain_similarity(const SimilarityLanes& lanes, const SimilarityLanes::Fall& fall,
                        std::span<const float> x_m, std::span<const float> y_m,
                        std::span<const float> heading_rad, std::span<float> explained,
                        Instructions instructions);

/// Computes exp(scale * logarithm) of each, to 5 digits; a product below -87 gives 1e-38, and none
/// may be above 80. Spans of one size; throws ContractError otherwise. All instruction sets give
/// the same bits. Cost: 1 ns each with AVX-512.
void exponentials(std::span<const float> logarithms, float scale, std::span<float> values,
                  Instructions instructions);

}  // namespace panonav::kernels
