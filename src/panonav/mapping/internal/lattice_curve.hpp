#pragma once

#include <optional>
#include <span>

#include "panonav/mapping/internal/node_motions.hpp"

namespace panonav {

/// Springs of less weight do not count for the curve from dissimilarity to distance.
inline constexpr double min_curve_weight = 0.25;

/// The curve before anything is laid out, proportional to the dissimilarity [M04 section 3.2]: in
/// metres where there is motion, else in the unit that phases give, else so that the median view
/// has its nearest one at 1. Sets the unit of the phases where motion or springs say it.
[[nodiscard]] DissimilarityCurve make_first_curve(std::span<const Lattice::Spring> measured,
                                                  const NodeMotions& motions,
                                                  const SpringViews& views,
                                                  Lattice::Errors& errors);

/// The curve that a layout shows: over its springs, or, without any, over all pairs that were
/// measured. Empty where there are none.
[[nodiscard]] std::optional<DissimilarityCurve> fit_curve(std::span<const Lattice::Spring> measured,
                                                          std::span<const Lattice::Spring> springs,
                                                          const SpringViews& views,
                                                          const LatticeStart& layout);

/// Sets how long the unit of phases is in a layout, and how far single lengths are off.
void fit_phase_unit(std::span<const Lattice::Spring> springs, std::span<const Pose2> poses,
                    Lattice::Errors& errors);

}  // namespace panonav
