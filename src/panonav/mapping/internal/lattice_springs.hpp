#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/lattice.hpp"

namespace panonav {

/// Ratio of the standard deviation of normal errors to the median of their absolute values.
inline constexpr double sigma_over_mad = 1.4826;

/// Two nodes, the smaller one first.
using NodePair = std::pair<std::size_t, std::size_t>;

/// Returns the phase reading of a spring from its node `from` to its other node. The spring must
/// have phases.
[[nodiscard]] inline PhaseReading read_phases_from(std::size_t from,
                                                   const Lattice::Spring& spring) {
  return from == spring.a ? *spring.phases : spring.phases->reversed();
}

/// All views of a memory, in its order, with the packed signatures and Fourier coefficients from
/// which springs are measured.
class SpringViews {
 public:
  SpringViews(const VisualMemory& memory, const LatticeOptions& options);

  [[nodiscard]] std::size_t size() const noexcept { return packed_.size(); }
  /// Returns the pairs of each view and its `neighbours` most similar ones, ascending, each once.
  [[nodiscard]] std::vector<NodePair> find_most_similar_pairs(const LatticeOptions& options,
                                                              Executor& executor) const;
  /// Returns the pairs of each view outside the largest component and the `count` most similar
  /// views of other components, ascending, each once.
  [[nodiscard]] std::vector<NodePair> find_similar_pairs_across(
      std::span<const std::size_t> components, int count, Executor& executor) const;
  [[nodiscard]] double dissimilarity(NodePair pair) const;
  /// Measures the dissimilarity of a pair and, with the option `phases`, the phases; does not set
  /// the length. `window`: allowed headings of the second node minus those of the first.
  [[nodiscard]] Lattice::Spring measure(
      NodePair pair, const std::optional<HeadingWindow>& window = std::nullopt) const;
  /// Returns the probability that the phases of a pair show the right direction, 0 if the views do
  /// not seem to be of one building (`PairFeatures`). Needs the option `phases`. Cost: some
  /// milliseconds.
  [[nodiscard]] double direction_probability(NodePair pair) const;
  /// Returns the pair of the first views that equal those of `pair`; both pairs give the same
  /// results.
  [[nodiscard]] NodePair find_first_equal(NodePair pair) const {
    return {first_equal_.at(pair.first), first_equal_.at(pair.second)};
  }

 private:
  /// Returns the pairs of each view and the `count` most similar ones, without the views that
  /// `excluded(node)` returns.
  template <class Excluded>
  [[nodiscard]] std::vector<NodePair> find_pairs(int count, Executor& executor,
                                                 const Excluded& excluded) const;

  const VisualMemory* memory_;
  int components_;
  std::vector<PackedSignature> packed_;
  std::vector<std::size_t> first_equal_;  // by node
  std::vector<HomingView> homing_;        // empty without phases
};

/// True if both views of the spring agree on their relative pose, or if it has no phases.
[[nodiscard]] bool has_agreeing_views(const Lattice::Spring& spring);

/// Estimates the standard deviations of angles from the disagreement between the two views of each
/// spring, and that of lengths from the curve; does not change that of phase lengths.
void learn_errors(std::span<const Lattice::Spring> springs, const DissimilarityCurve& curve,
                  Lattice::Errors& errors);

/// Makes the equation of a spring. `phase_lengths`: lengths from phases are used, too.
[[nodiscard]] SpringTerm make_spring_term(const Lattice::Spring& spring,
                                          const Lattice::Errors& errors, bool phase_lengths);

/// Returns for each spring the share, 0 .. 1, of its triangles with two other springs that close in
/// turn and in displacement by the rest lengths; 0 without triangles or phases. Cost: springs *
/// springs of a node.
[[nodiscard]] std::vector<double> closing_triangle_shares(std::size_t nodes,
                                                          std::span<const Lattice::Spring> springs);

/// Drops each spring if at most the share `min_closing` of its triangles close. A view that would
/// lose all springs keeps those to the component to which most of its springs lead, so that it
/// never joins two components, or else those to other such views.
void drop_unconfirmed_springs(std::size_t nodes, double min_closing,
                              std::vector<Lattice::Spring>& springs);

}  // namespace panonav
