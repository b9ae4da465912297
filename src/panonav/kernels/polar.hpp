#pragma once

#include <span>

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Computes the magnitudes and phases of the complex numbers real[i] + j imaginary[i]. Magnitudes
/// are exact to a few units in the last place, phases to 3e-7 rad; phases are in [-pi, pi), and 0
/// where the magnitude is 0 (that is, where it underflows below about 1e-23). Values must be finite
/// and below 1e18. Throws ContractError unless all spans have one size.
void to_polar(std::span<const float> real, std::span<const float> imaginary,
              std::span<float> magnitudes, std::span<float> phases_rad, Instructions instructions);

}  // namespace panonav::kernels
