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
  LatticeLayout layout;
  /// Agreement of each spring inside a component with the layout: 1 if the poses are as its phases
  /// measured them, 0.25 at the limit of agreement.
  std::map<std::pair<std::size_t, std::size_t>, double> weights;
  /// Pairs of views, with repetitions, to measure before the components grow again.
  std::vector<std::pair<std::size_t, std::size_t>> proposals;
  double energy = 0.0;
  int iterations = 0;
};

/// Lays out `nodes` views by springs of which many may join places that only look similar: grows
/// connected components from the most certain ones.
/// 1. The probability that a spring is right is learnt for each rank (lattice_links.hpp).
/// 2. The two components are joined whose springs agree best on one relative pose, at odds of 19 to
///    1 times the number of views that the join could misplace (join_evidence.hpp).
/// 3. Whenever a component has grown by a quarter, it is averaged over its springs
///    (component_layout.hpp).
///
/// `step_callback`: called after each join. `start`: initial components; empty for single views.
/// Lengths in the layout are `unit` times those of the phases. Deterministic. Cost: 1 s for 1,000
/// views of 12 springs.
[[nodiscard]] GrownLayout grow_components(std::size_t nodes,
                                          std::span<const Lattice::Spring> springs, double unit,
                                          const LatticeLayout& start = {},
                                          const LatticeStepCallback& step_callback = {});

/// True if the poses of two views in the final layout agree with the phases of their spring: turn
/// within 15 degrees, direction within 45, length within a factor of three.
[[nodiscard]] bool fits_layout(const Lattice::Spring& spring, double unit, const Pose2& a,
                               const Pose2& b);

}  // namespace panonav
