#pragma once

#include <optional>
#include <span>

#include "panonav/mapping/internal/node_motions.hpp"

namespace panonav {

/// Smallest weight of springs that are used to fit the curve from dissimilarity to distance.
inline constexpr double min_curve_weight = 0.25;

/// Makes the curve for the first layout: distance proportional to dissimilarity [M04 section 3.2].
/// Distances are in metres if there are motions, otherwise in the unit of the phases. Without
/// phases, the median distance between a view and its nearest one is 1. Sets `errors.phase_unit` if
/// motions show it.
[[nodiscard]] DissimilarityCurve make_first_curve(std::span<const Lattice::Spring> measured,
                                                  const NodeMotions& motions,
                                                  const SpringViews& views,
                                                  Lattice::Errors& errors);

/// Fits the curve to the springs of a layout or, without springs, to all measured pairs; nullopt if
/// there are none.
[[nodiscard]] std::optional<DissimilarityCurve> fit_curve(std::span<const Lattice::Spring> measured,
                                                          std::span<const Lattice::Spring> springs,
                                                          const SpringViews& views,
                                                          const LatticeLayout& layout);

/// Estimates the unit of lengths from phases in a layout and the relative error of such lengths,
/// and sets both in `errors`.
void fit_phase_unit(std::span<const Lattice::Spring> springs, std::span<const Pose2> poses,
                    Lattice::Errors& errors);

}  // namespace panonav
