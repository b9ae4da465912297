#pragma once

#include <array>

#include "panonav/relative_pose/turn_correlation.hpp"

// Weights of components by coherence: inside of fourier_homing.cpp, not for users.

namespace panonav {

/// A number for each frequency; 0 counts for nothing.
using PerFrequency = std::array<double, TurnCorrelation::max_frequencies + 1>;

/// The Gaussian exp(-k^2 / (2 width^2)) that is nearest to the coherences in least squares, up to
/// its height: noise lowers all coherences, distance the high ones first. One row gives little more
/// than a sign for each frequency, so only one number is asked of all of them.
[[nodiscard]] PerFrequency fitted_gaussian(const PerFrequency& coherences, int highest);

/// Weights over amplitudes; their sum stays. `power`: the mean of the powers.
void over_amplitude(PerFrequency& weights, const PerFrequency& powers, double power, int highest);

}  // namespace panonav
