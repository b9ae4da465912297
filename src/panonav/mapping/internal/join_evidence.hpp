#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/mapping/internal/component_layout.hpp"

namespace panonav {

/// Views nearer than this, in typical links, are adjacent and should look similar.
inline constexpr double adjacent_lengths = 0.8;
/// Distance in typical links from where two components meet up to which their layouts count:
/// farther off they may have drifted.
inline constexpr double near_lengths = 3.0;

/// A relative pose of two components, and its log-odds against chance.
struct JoinHypothesis {
  double evidence;
  Pose2 p_from_q;
};

/// Returns the relative pose of components p and q for which their links are most evidence, less
/// that for the best other one (docs/equations.md). There must be links. Cost: hypotheses times
/// links, and the pairs of views of both where the evidence is above 0.
[[nodiscard]] JoinHypothesis find_best_hypothesis(const ComponentLayout& layout, std::size_t p,
                                                  std::size_t q);

}  // namespace panonav
