#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/mapping/internal/component_layout.hpp"

namespace panonav {

/// Views nearer than this lie beside each other and should look alike; in typical links.
inline constexpr double beside_lengths = 0.8;
/// Layouts of two components are trusted this far from where they meet, in typical links.
inline constexpr double near_lengths = 3.0;

/// A relative pose of two components, and the log-odds that it is right against chance.
struct JoinHypothesis {
  double evidence;
  Pose2 p_from_q;
};

/// The relative pose of components p and q that their links say best, its evidence less that of the
/// best other one (docs/equations.md). There must be links. Cost: hypotheses times links, and the
/// pairs of views of both where the evidence is above 0.
[[nodiscard]] JoinHypothesis best_hypothesis(const ComponentLayout& layout, std::size_t p,
                                             std::size_t q);

}  // namespace panonav
