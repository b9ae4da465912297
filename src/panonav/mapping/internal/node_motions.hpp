#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/internal/lattice_start.hpp"

namespace panonav {

/// The coarse motions of a robot between nodes of the lattice.
class NodeMotions {
 public:
  /// Throws ContractError on a motion with a view that the memory does not have, or numbers out of
  /// range. Motions from a view to itself are left out.
  NodeMotions(const VisualMemory& memory, std::span<const CoarseMotion> motions);

  [[nodiscard]] bool empty() const noexcept { return motions_.empty(); }
  [[nodiscard]] std::span<const NodeMotion> all() const noexcept { return motions_; }
  /// Returns the first motion between two nodes, or null.
  [[nodiscard]] const NodeMotion* find(NodePair pair) const;
  /// True if the motions connect all of `nodes` nodes.
  [[nodiscard]] bool are_all_connected(std::size_t nodes) const;
  /// Returns the headings of the second node in the frame of the first that the motion between both
  /// allows; nullopt without a motion.
  [[nodiscard]] std::optional<HeadingWindow> heading_between(NodePair pair) const;
  /// Returns each motion as a spring that is never rejected.
  [[nodiscard]] std::vector<SpringTerm> spring_terms() const;
  /// Returns the scale factor with which the layout fits the lengths of the motions best (least
  /// squares); nullopt if all motions have length 0.
  [[nodiscard]] std::optional<double> layout_scale(std::span<const Pose2> poses) const;

 private:
  std::vector<NodeMotion> motions_;
  std::map<NodePair, std::size_t> first_;  // number of the first motion between two nodes
};

/// Length of a motion's step.
[[nodiscard]] double step_length(const NodeMotion& motion);

}  // namespace panonav
