#pragma once

#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes, for each pose, the part of the squared similarities of a view to nearby references
/// that the pose explains: (sum similarity * expected)^2 / sum expected^2, with expected =
/// exp(-sqrt(distance^2 + blur_square_m2) * per_metre). Each similarity is multiplied by exp(turn^2
/// * per_square_turn), where `turn` is the angle between the pose's heading and the heading that
/// the reference implies; of the two headings of a reference the one with the larger product is
/// used. Spans of one size; throws ContractError otherwise. All instruction sets give the same
/// bits. Cost: about 5 ns per pose with AVX-512, in blocks of 16 poses.
void explain_similarity(const SimilarityLanes& lanes, const SimilarityLanes::Decay& decay,
                        std::span<const float> x_m, std::span<const float> y_m,
                        std::span<const float> heading_rad, std::span<float> explained,
                        Instructions instructions);

/// Computes values[i] = exp(scale * logarithms[i]) to 5 digits. Products below -87 give 1e-38;
/// products above 80 are not allowed. Spans of one size; throws ContractError otherwise. All
/// instruction sets give the same bits. Cost: 1 ns each with AVX-512.
void exponentials(std::span<const float> logarithms, float scale, std::span<float> values,
                  Instructions instructions);

}  // namespace panonav::kernels
