#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/internal/lattice_start.hpp"

namespace panonav {

/// The coarse motions of a robot as the lattice uses them: between its nodes.
class NodeMotions {
 public:
  /// Throws ContractError on a motion with a view that the memory does not have, or numbers out of
  /// range. Motions from a view to itself are left out.
  NodeMotions(const VisualMemory& memory, std::span<const CoarseMotion> motions);

  [[nodiscard]] bool empty() const noexcept { return motions_.empty(); }
  [[nodiscard]] std::span<const NodeMotion> all() const noexcept { return motions_; }
  /// The first motion between two nodes, or null.
  [[nodiscard]] const NodeMotion* between(NodePair pair) const;
  /// Whether they lead from each of `nodes` nodes to every other one.
  [[nodiscard]] bool connect(std::size_t nodes) const;
  /// The headings of the second node in the frame of the first that the motion between them allows;
  /// nullopt without a motion.
  [[nodiscard]] std::optional<HeadingWindow> heading_between(NodePair pair) const;
  /// Each motion as a spring that is never rejected.
  [[nodiscard]] std::vector<SpringTerm> terms() const;
  /// The factor by which the layout must grow so that the motions have their lengths in it, by
  /// least squares; empty where all have none.
  [[nodiscard]] std::optional<double> scale_of(std::span<const Pose2> poses) const;

 private:
  std::vector<NodeMotion> motions_;
  std::map<NodePair, std::size_t> first_;  // motion of two nodes
};

/// Length of a motion's step.
[[nodiscard]] double travel(const NodeMotion& motion);

}  // namespace panonav
