#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/mapping/internal/lattice_solver.hpp"
#include "panonav/mapping/lattice.hpp"

namespace panonav {

/// Deviation of normal errors over their median size.
inline constexpr double normal_over_median = 1.4826;

/// Two nodes, the smaller one first.
using NodePair = std::pair<std::size_t, std::size_t>;

/// The views of a memory as springs need them, in the memory's order.
class SpringViews {
 public:
  SpringViews(const VisualMemory& memory, const LatticeOptions& options);

  [[nodiscard]] std::size_t size() const noexcept { return packed_.size(); }
  /// The `neighbours` most similar views of each view. Ascending, each pair once.
  [[nodiscard]] std::vector<NodePair> most_similar(const LatticeOptions& options,
                                                   Executor& executor) const;
  [[nodiscard]] double dissimilarity(NodePair pair) const;
  /// Dissimilarity and, with the option, phases; no length yet. `hint`: turn from the first to the
  /// second node.
  [[nodiscard]] Lattice::Spring measure(
      NodePair pair, const std::optional<HeadingWindow>& hint = std::nullopt) const;

 private:
  const VisualMemory* memory_;
  int components_;
  std::vector<PackedSignature> packed_;
  std::vector<HomingView> homing_;  // empty when phases do not count
};

/// Whether the two views of the spring agree on how they lie to each other; true without phases.
[[nodiscard]] bool agrees(const Lattice::Spring& spring);

/// What the springs' views disagree on, and the curve's error, make the deviations; those of phase
/// lengths are not touched.
void learn_errors(std::span<const Lattice::Spring> springs, const DissimilarityCurve& curve,
                  Lattice::Errors& errors);

/// The spring as the solver sees it. `phase_lengths`: the lengths that phases tell count, too.
[[nodiscard]] SpringTerm spring_term(const Lattice::Spring& spring, const Lattice::Errors& errors,
                                     bool phase_lengths);

/// For each spring the share of the triangles with two others that close, in turn and in
/// displacement by their rest lengths, 0 .. 1; 0 where there are none, and without phases. Cost:
/// springs * springs of a node.
[[nodiscard]] std::vector<double> closing_triangles(std::size_t nodes,
                                                    std::span<const Lattice::Spring> springs);

/// Leaves out springs of whose triangles no more than the share `min_closing` close. A view without
/// any that does hangs on the one component to which most of its springs lead, so that it never
/// joins two; or on others of its kind.
void keep_confirmed(std::size_t nodes, double min_closing, std::vector<Lattice::Spring>& springs);

}  // namespace panonav
