#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "panonav/mapping/internal/lattice_start.hpp"
#include "panonav/mapping/lattice.hpp"

namespace panonav {

struct GrownLayout {
  LatticeStart start;
  /// Of springs whose views are in one component: 1 where the layout has them as the phases do,
  /// 0.25 at the limit of what counts as agreeing.
  std::map<std::pair<std::size_t, std::size_t>, double> weights;
  /// Pairs of views, with repetitions, to measure before the components grow again.
  std::vector<std::pair<std::size_t, std::size_t>> proposals;
  double energy = 0.0;
  int iterations = 0;
};

/// Lays out `nodes` views by springs of which many may join places that only look alike: grows
/// connected components from the most certain ones.
///
/// 1. The probability that a spring is right follows from its rank: at both ends, the number of
///    springs that leave less of the two views unexplained. It is learnt for each rank from the
///    springs themselves, as the share of those that close a triangle with springs of low rank.
/// 2. Each view starts as a component of its own. The two components are joined whose springs agree
///    best on one relative pose: the sum of log-likelihood ratios of the springs that agree with
///    it against chance, less that of the best other relative pose. The views of a spring that is
///    longer in the layout than others must also be less similar (concordance); adjacent views that
///    are not similar contradict.
/// 3. A join needs odds of 19 to 1, times the number of views that it could misplace. Other
///    components stay apart.
/// 4. Whenever a component has grown by a quarter, its headings and positions are averaged over its
///    springs, both with the absolute loss.
///
/// Steps 1 to 4 are in `lattice_links.hpp`, `join_evidence.hpp` and `component_layout.hpp`. Their
/// values were chosen on the worlds `loop`, `garden`, `hall`, `office` and two generated floors,
/// seeds 1 to 3 (docs/decisions.md, Spring lattice).
///
/// `watch` is called after each join. `start`: initial components instead of single views; empty
/// for none. Lengths in the layout are `unit` times those of the phases. Springs whose views
/// disagree do not count. Deterministic. Cost: about 1 s for 1,000 views of 12 springs.
[[nodiscard]] GrownLayout grow_components(std::size_t nodes,
                                          std::span<const Lattice::Spring> springs, double unit,
                                          const LatticeStart& start = {},
                                          const LatticeWatch& watch = {});

/// True if the poses of two views in the final layout agree with the phases of their spring: turn
/// within 15 degrees, direction within 45, length within a factor of three.
[[nodiscard]] bool fits_layout(const Lattice::Spring& spring, double unit, const Pose2& a,
                               const Pose2& b);

}  // namespace panonav
