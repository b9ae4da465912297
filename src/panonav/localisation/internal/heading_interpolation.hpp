#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "panonav/localisation/place.hpp"

namespace panonav {

/// Number of best matches whose headings are interpolated, and of which the nearest is listed
/// first: a grid square has four corners.
inline constexpr std::size_t nearest_reference_count = 4;

/// Returns the heading of the robot at `position` from its headings relative to the best references
/// around it. The compass errs by an amount that grows with the displacement from the reference, in
/// opposite directions on opposite sides, so a plane is fitted through the headings over the
/// positions of the references; without a position their mean is returned. Weighted with the
/// inverse fourth power of the column difference, because the compass's error grows with the square
/// of the difference. Ignores headings far from that of the best match, which are outliers of the
/// compass. nullopt if no match has a heading.
[[nodiscard]] std::optional<double> interpolate_heading(
    const VisualMemory& memory, std::span<const PlaceMatch> matches,
    const std::optional<PositionEstimate>& position);

}  // namespace panonav
