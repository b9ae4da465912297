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
  /// Of springs whose views are in one component: 1 where the layout has them as the phases say,
  /// 0.25 at the limit of what counts as agreeing.
  std::map<std::pair<std::size_t, std::size_t>, double> weights;
  /// Pairs of views, with repetitions, that are worth measuring before the components grow again.
  std::vector<std::pair<std::size_t, std::size_t>> proposals;
  double energy = 0.0;
  int iterations = 0;
};

/// Lays out `nodes` views by springs of which many may join places that only look alike: grows
/// connected components from what is certain.
///
/// 1. How likely a spring is right follows from its rank: at both ends, how many springs leave less
///    of the two views unexplained. The probability of a rank is learnt from the springs
///    themselves, as the share of those with a triangle of springs of low rank that closes.
/// 2. Each view begins as a component of its own. The two components are joined whose springs agree
///    best on one relative pose: the sum of log-likelihood ratios of the springs that agree with
///    it against chance, less that of the best other relative pose. A spring that is longer in the
///    layout than others of its views must also look less alike than these (concordance); views
///    that come to lie on top of each other without looking alike contradict.
/// 3. A join needs odds of 19 to 1, times the number of views that it could misplace. What falls
///    short stays apart.
/// 4. Whenever a component has grown by a quarter, its headings and positions are averaged over its
///    springs again, both with the absolute loss.
///
/// Steps 1 to 4 are in `lattice_links.hpp`, `join_evidence.hpp` and `component_layout.hpp`. Their
/// values were chosen on the worlds `loop`, `garden`, `hall`, `office` and two generated floors,
/// seeds 1 to 3 (docs/decisions.md, Spring lattice).
///
/// `watch` is called after each join. `start`: components to begin with, instead of single views;
/// empty for none. Lengths in the layout are `unit` times those of the phases. Springs whose views
/// disagree do not count. Deterministic. Cost: about 1 s for 1,000 views of 12 springs.
[[nodiscard]] GrownLayout grow_components(std::size_t nodes,
                                          std::span<const Lattice::Spring> springs, double unit,
                                          const LatticeStart& start = {},
                                          const LatticeWatch& watch = {});

/// Whether the poses of two views agree with what their spring's phases say, after the layout has
/// been made: turn within 15 degrees, direction within 45, length within a factor of three.
[[nodiscard]] bool fits(const Lattice::Spring& spring, double unit, const Pose2& a, const Pose2& b);

}  // namespace panonav
