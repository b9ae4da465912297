#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "panonav/relative_pose/internal/pair_equations.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// A number for each frequency; entry 0 is not used.
using PerFrequency = std::array<double, TurnCorrelation::max_frequencies + 1>;

/// Weighs the components 1 .. highest by the coherence of both views at the present turn: a
/// Gaussian as wide as the coherent components, over their amplitude. The power of views falls with
/// about the square of the frequency [S06 section 4.5], so that without the amplitude the first few
/// would decide alone. Residuals by unequal distances are a share of the power, those by pixels are
/// equal for all frequencies: the amplitude is half way between the two.
[[nodiscard]] PerFrequency weigh_components(PairCoefficients& coefficients, int highest,
                                            std::size_t rows);

/// Weighs rows by their coherence within the weighted components.
[[nodiscard]] std::vector<float> weigh_rows(PairCoefficients& coefficients, int highest,
                                            std::size_t rows, const PerFrequency& weights);

}  // namespace panonav
