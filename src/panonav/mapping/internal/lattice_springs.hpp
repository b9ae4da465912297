#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/lattice.hpp"

namespace panonav {

/// Standard deviation of normal errors over the median of their absolute values.
inline constexpr double normal_over_median = 1.4826;

/// Two nodes, the smaller one first.
using NodePair = std::pair<std::size_t, std::size_t>;

/// Returns the phases of a spring that has them, as its node `from` sees the other one.
[[nodiscard]] inline PhaseReading read_phases_from(std::size_t from,
                                                   const Lattice::Spring& spring) {
  return from == spring.a ? *spring.phases : spring.phases->reversed();
}

/// The views of a memory in the forms that springs need, in the memory's order.
class SpringViews {
 public:
  SpringViews(const VisualMemory& memory, const LatticeOptions& options);

  [[nodiscard]] std::size_t size() const noexcept { return packed_.size(); }
  /// Returns the pairs of each view and its `neighbours` most similar ones, ascending, each once.
  [[nodiscard]] std::vector<NodePair> find_most_similar(const LatticeOptions& options,
                                                        Executor& executor) const;
  [[nodiscard]] double dissimilarity(NodePair pair) const;
  /// Measures the dissimilarity and, with the option, the phases; no length yet. `window`: headings
  /// of the second node minus those of the first that are considered.
  [[nodiscard]] Lattice::Spring measure(
      NodePair pair, const std::optional<HeadingWindow>& window = std::nullopt) const;

 private:
  const VisualMemory* memory_;
  int components_;
  std::vector<PackedSignature> packed_;
  std::vector<HomingView> homing_;  // empty without phases
};

/// True if the two views of the spring agree on their relative pose, or without phases.
[[nodiscard]] bool has_agreeing_views(const Lattice::Spring& spring);

/// Learns the deviations from the disagreement of the springs' views and the curve's error; those
/// of phase lengths do not change.
void learn_errors(std::span<const Lattice::Spring> springs, const DissimilarityCurve& curve,
                  Lattice::Errors& errors);

/// Makes the equation of a spring. `phase_lengths`: the lengths by phases count, too.
[[nodiscard]] SpringTerm make_spring_term(const Lattice::Spring& spring,
                                          const Lattice::Errors& errors, bool phase_lengths);

/// Returns for each spring the share of the triangles with two others that close, in turn and in
/// displacement by their rest lengths, 0 .. 1; 0 where there are none, and without phases. Cost:
/// springs * springs of a node.
[[nodiscard]] std::vector<double> closing_triangle_shares(std::size_t nodes,
                                                          std::span<const Lattice::Spring> springs);

/// Drops springs of whose triangles no more than the share `min_closing` close. A view without any
/// other keeps those to the one component to which most of its springs lead, so that it never joins
/// two; or those to other such views.
void drop_unconfirmed(std::size_t nodes, double min_closing, std::vector<Lattice::Spring>& springs);

}  // namespace panonav
