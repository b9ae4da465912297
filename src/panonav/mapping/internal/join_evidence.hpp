#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "panonav/mapping/internal/component_layout.hpp"

namespace panonav {

/// Views nearer than this, in typical link lengths, are adjacent and should look similar.
inline constexpr double adjacent_distance_in_links = 0.8;
/// Distance, in typical link lengths, from the place where two components meet within which their
/// layouts are compared; farther away they may have drifted.
inline constexpr double near_distance_in_links = 3.0;

// Values without another source were chosen on simulated worlds.

/// Probability that a wrong link agrees with the relative pose of others: once in five times, as
/// rooms and shelves are parallel to each other. q in docs/equations.md.
inline constexpr double p_chance = 0.2;
/// Probability that adjacent views agree on their relative pose. a in docs/equations.md.
inline constexpr double p_adjacent_agree = 0.7;
/// Smallest odds for a join per view of the smaller component: 19 to 1, that is 95 %
/// (docs/decisions.md).
inline constexpr double min_join_odds = 19.0;

/// A relative pose of two components, and its log-odds against chance.
struct JoinHypothesis {
  double evidence;
  Pose2 p_from_q;
};

/// Returns the relative pose of components p and q with the largest evidence by their links; the
/// evidence for the best other pose is subtracted (docs/equations.md). The components must have
/// links to each other. Cost: hypotheses times links and, if the evidence is above 0, the pairs of
/// views of both.
[[nodiscard]] JoinHypothesis find_best_hypothesis(const ComponentLayout& layout, std::size_t p,
                                                  std::size_t q);

}  // namespace panonav
