#pragma once

#include <span>

#include "panonav/kernels/dispatch.hpp"
#include "panonav/kernels/likeness_targets.hpp"

namespace panonav::kernels {

/// How much of a view's squared likeness to the references around a place each pose explains:
/// (sum likeness expected)^2 / sum expected^2 with expected = exp(-sqrt(distance^2 + blur) *
/// per_metre), where each likeness counts exp(turn^2 per_square_turn), turn being what the pose's
/// heading is off from what the reference tells; of the two headings the one that counts more.
/// Spans of one size; throws ContractError otherwise. All instruction sets give the same bits.
/// Cost: about 5 ns a pose with AVX-512; sixteen poses cost as much as one.
void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall,
                      std::span<const float> x_m, std::span<const float> y_m,
                      std::span<const float> heading_rad, std::span<float> explained,
                      Instructions instructions);

/// exp(scale * logarithm) of each, to 5 digits; a product below -87 gives 1e-38, and none may be
/// above 80. Spans of one size; throws ContractError otherwise. All instruction sets give the same
/// bits. Cost: 1 ns each with AVX-512.
void exponentials(std::span<const float> logarithms, float scale, std::span<float> values,
                  Instructions instructions);

}  // namespace panonav::kernels
