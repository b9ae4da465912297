#pragma once

#include <optional>
#include <span>

#include "panonav/mapping/internal/node_motions.hpp"

namespace panonav {

/// Smallest weight of springs that count for the curve from dissimilarity to distance.
inline constexpr double min_curve_weight = 0.25;

/// Makes the curve before the first layout, proportional to the dissimilarity [M04 section 3.2]: in
/// metres where there is motion, else in the unit of the phases, else so that the median view has
/// its nearest one at 1. Sets the unit of the phases where motions show it.
[[nodiscard]] DissimilarityCurve make_first_curve(std::span<const Lattice::Spring> measured,
                                                  const NodeMotions& motions,
                                                  const SpringViews& views,
                                                  Lattice::Errors& errors);

/// Fits the curve to a layout: over its springs, or, without any, over all measured pairs. nullopt
/// where there are none.
[[nodiscard]] std::optional<DissimilarityCurve> fit_curve(std::span<const Lattice::Spring> measured,
                                                          std::span<const Lattice::Spring> springs,
                                                          const SpringViews& views,
                                                          const LatticeStart& layout);

/// Fits the unit of phases in a layout, and the error of single lengths.
void fit_phase_unit(std::span<const Lattice::Spring> springs, std::span<const Pose2> poses,
                    Lattice::Errors& errors);

}  // namespace panonav
