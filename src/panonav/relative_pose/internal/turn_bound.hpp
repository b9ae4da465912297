#pragma once

#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// Returns an upper bound of the correlation over all turns, at most 8 % of the sum of all
/// amplitudes above its maximum. Cost: eight points per period of the highest frequency.
[[nodiscard]] float bound_maximum(const TurnCorrelation& correlation) noexcept;

}  // namespace panonav
