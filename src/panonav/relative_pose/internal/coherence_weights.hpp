#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "panonav/relative_pose/internal/pair_equations.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// A number for each frequency; entry 0 is not used.
using PerFrequency = std::array<double, TurnCorrelation::max_frequencies + 1>;

/// Returns weights of the components 1 .. highest: a Gaussian fitted to the coherence of both views
/// at the present turn, over the amplitude of each component. The power of views falls with about
/// the square of the frequency [S06 section 4.5], so that without this division the first few
/// components would decide alone. Residuals by unequal distances are a share of the power, and
/// residuals by pixels are equal for all frequencies; the amplitude is half way between the two.
[[nodiscard]] PerFrequency compute_component_weights(PairCoefficients& coefficients, int highest,
                                                     std::size_t rows);

/// Computes a weight for each row: the coherence of both views in it over the weighted components.
void compute_row_weights(PairCoefficients& coefficients, int highest, const PerFrequency& weights,
                         std::span<float> row_weights);

}  // namespace panonav
