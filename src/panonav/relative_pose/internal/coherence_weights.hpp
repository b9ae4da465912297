#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "panonav/relative_pose/internal/pair_equations.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

// Weights of components and rows by coherence: inside of fourier_homing.cpp, not for users.

namespace panonav {

/// A number for each frequency; 0 counts for nothing.
using PerFrequency = std::array<double, TurnCorrelation::max_frequencies + 1>;

/// Weights of the components 1 .. highest by the coherence of both views at the present turn: a
/// Gaussian as wide as there are coherent ones, over their amplitude. The power of views falls with
/// about the square of the frequency [S06 section 4.5], so that without the amplitude the first few
/// would decide alone. What unequal distances leave unexplained is a share of the power, what
/// pixels leave is the same for all frequencies: the amplitude is half way between the two.
[[nodiscard]] PerFrequency weigh_components(PairCoefficients& coefficients, int highest,
                                            std::size_t rows);

/// Weights of rows by their coherence within the components that count.
[[nodiscard]] std::vector<float> weigh_rows(PairCoefficients& coefficients, int highest,
                                            std::size_t rows, const PerFrequency& weights);

}  // namespace panonav
