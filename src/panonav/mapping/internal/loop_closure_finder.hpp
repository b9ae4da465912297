#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "panonav/mapping/loop_closure.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A node of the map in the search for closures.
struct PathNode {
  ViewId view;                ///< an id of the memory
  double path_m = 0.0;        ///< path length of the robot from its first view
  std::size_t component = 0;  ///< its connected component, in whose frame its pose is
};

/// The nodes among which closures are searched.
enum class ClosureScope {
  everywhere,        ///< all nodes of the map
  other_components,  ///< not in the connected component of the latest node
};

/// Finds loop closures while the robot drives. Candidates come from the memory's search. Home
/// vectors in both directions must agree with the compass and be each other's inverse; the search
/// from the candidate must find the present view; the path must allow it; no
/// other such place may explain the view as well; and the closures of successive views must agree.
class LoopClosureFinder {
 public:
  /// `memory` must outlive the finder. Throws OptionError.
  LoopClosureFinder(const VisualMemory& memory, const LoopClosureOptions& options,
                    const VisualOdometryOptions& odometry,
                    ClosureScope scope = ClosureScope::everywhere);

  /// True if the path between both nodes allows the closure.
  using IsPossible = std::function<bool(const LoopClosure&)>;

  /// Returns the closures that have become certain with the last of `nodes`, whose view is the
  /// latest of the memory: those of the node `sequence - 1` before it, if no closure of the nodes
  /// around it explains the views better. `poses`: poses of the nodes in the map so far, which
  /// distinguish places and check the sequence. `scale_m`: metric scale of visual displacements;
  /// `is_possible`: is asked about each candidate, so that of places that look alike only those
  /// that the path allows compete. Throws ContractError on different numbers of nodes and poses.
  /// Cost: two searches of the memory and, where there are candidates, 0.3 ms for each.
  [[nodiscard]] std::vector<LoopClosure> find(std::span<const PathNode> nodes,
                                              std::span<const Pose2> poses,
                                              const OdometryView& view, double scale_m,
                                              const IsPossible& is_possible);

  /// Returns the closures of the last `sequence - 1` nodes, which `find` decides only after later
  /// nodes: call it at the end of a path, with the nodes and poses of the last `find`. A drive that
  /// ends where it began has its closure here.
  [[nodiscard]] std::vector<LoopClosure> finish(std::span<const PathNode> nodes,
                                                std::span<const Pose2> poses);

  /// Returns the closure of two nodes if home vectors in both directions and the compass agree on
  /// it; nullopt otherwise. Cost: 0.6 ms.
  [[nodiscard]] std::optional<LoopClosure> verify_closure(std::size_t earlier, std::size_t later,
                                                          const OdometryView& earlier_view,
                                                          const OdometryView& later_view) const;
  /// True if two closures agree with the motion between their nodes: along the path of the later
  /// nodes, and along that of the earlier ones.
  [[nodiscard]] bool agree(const LoopClosure& a, const LoopClosure& b,
                           std::span<const Pose2> poses) const;

 private:
  /// Returns the closure of a node if it is certain by those of the nodes around it.
  [[nodiscard]] std::optional<LoopClosure> decide(std::span<const PathNode> nodes,
                                                  std::span<const Pose2> poses, std::size_t node);
  [[nodiscard]] std::optional<LoopClosure> find_best_closure(std::span<const PathNode> nodes,
                                                             std::span<const Pose2> poses,
                                                             const OdometryView& view,
                                                             const IsPossible& is_possible) const;
  [[nodiscard]] bool is_reciprocal(std::span<const PathNode> nodes, std::span<const Pose2> poses,
                                   const LoopClosure& closure) const;
  /// Returns the views that are no candidates for a closure with the node.
  [[nodiscard]] std::vector<ViewId> find_excluded_views(std::span<const PathNode> nodes,
                                                        std::size_t node) const;
  [[nodiscard]] std::optional<std::size_t> find_node(std::span<const PathNode> nodes,
                                                     ViewId view) const;

  const VisualMemory* memory_;
  LoopClosureOptions options_;
  VisualOdometryOptions odometry_;
  ClosureScope scope_;
  double last_closure_path_m_ = 0.0;  // path length at the last closure
  std::deque<LoopClosure> pending_;   // of the last views, oldest first
};

}  // namespace panonav
