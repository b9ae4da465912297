#pragma once

#include <cstddef>
#include <deque>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Conditions of a loop closure. Wrong closures are worse than missing ones, so a candidate must
/// pass every check.
struct LoopClosureOptions {
  /// Candidates for each view, from the memory's search.
  int candidates = 5;
  /// Views nearer than this along the path are no candidates: there is no loop to close.
  double min_loop_m = 3.0;
  /// The view explains the candidate up to this share of the energy of both.
  double max_residual = 0.2;
  /// Farther apart, in units of R, the views are not reliable.
  double max_length = 0.3;
  /// Largest disagreement on the heading between the compass and the home vectors there and back.
  double heading_tolerance_rad = 0.15;
  /// Largest distance between start and end after both home vectors, in units of R.
  double return_tolerance = 0.1;
  /// Another place that explains the view nearly as well makes it ambiguous: the residual of the
  /// best must be smaller by this factor.
  double distinctness = 1.5;
  /// The search from the candidate must lead back to here among so many views.
  int reciprocal_rank = 5;
  /// This many successive views must have closures that agree with the motion between them.
  int sequence = 3;
  /// Distance along the path between reported closures: closer ones add nothing and cost time.
  double spacing_m = 0.5;
  /// Drift of the odometry, in metres for each metre, beyond which no closure is believed: counted
  /// from the last closure, and a fifth of it along the rest of the loop. One R comes on top. The
  /// heading may be off by twice this, in rad, and `heading_tolerance_rad`.
  double max_drift = 0.1;
};
void visit_options(LoopClosureOptions& options, OptionVisitor& visitor);

/// A node of the map for the search for closures.
struct PassedNode {
  ViewId view;                ///< an id of the memory
  double way_m = 0.0;         ///< along the way of the robot from its first view to here
  std::size_t component = 0;  ///< its connected component, in whose frame its pose is
};

/// Two nodes that see the same place.
struct LoopClosure {
  std::size_t earlier = 0;   ///< place among the nodes given
  std::size_t later = 0;     ///< place among the nodes given, after `earlier`
  Pose2 earlier_from_later;  ///< pose of the later node in the frame of the earlier one, metres
  double residual = 0.0;     ///< share of the energy of both views left unexplained
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

/// Where the finder looks for the other node of a closure.
/// Among which nodes the finder looks.
enum class ClosureScope {
  everywhere,        ///< all nodes of the map
  other_components,  ///< not in the connected component of the latest node
};

/// Finds loop closures while the robot drives. Candidates come from the memory's search. Home
/// vectors in both directions must agree with the compass and be each other's inverse; the search
/// from the candidate must lead back to here; no other place may explain the view as well; the
/// drift of the odometry must allow it; and a sequence of views must agree.
class LoopClosureFinder {
 public:
  /// `memory` must outlive the finder. Throws OptionError.
  LoopClosureFinder(const VisualMemory& memory, const LoopClosureOptions& options,
                    const VisualOdometryOptions& odometry,
                    ClosureScope scope = ClosureScope::everywhere);

  /// The last of `nodes` is new and its view is in the memory; `poses` is the map so far, by which
  /// places are told from each other and the sequence is judged. `scale_m` as of the odometry.
  /// Returns the closures that have become certain with this view: none, or those of the whole
  /// sequence. Throws ContractError on different numbers of nodes and poses. Cost: two searches of
  /// the memory and, where there are candidates, 0.3 ms for each.
  [[nodiscard]] std::vector<LoopClosure> find(std::span<const PassedNode> nodes,
                                              std::span<const Pose2> poses,
                                              const OdometryView& view, double scale_m);

 private:
  [[nodiscard]] std::optional<LoopClosure> best_closure(std::span<const PassedNode> nodes,
                                                        std::span<const Pose2> poses,
                                                        const OdometryView& view) const;
  [[nodiscard]] std::optional<LoopClosure> compare(std::size_t earlier, std::size_t later,
                                                   const OdometryView& earlier_view,
                                                   const OdometryView& later_view) const;
  [[nodiscard]] bool is_reciprocal(std::span<const PassedNode> nodes, std::span<const Pose2> poses,
                                   const LoopClosure& closure) const;
  [[nodiscard]] bool is_in_reach(std::span<const PassedNode> nodes, std::span<const Pose2> poses,
                                 const LoopClosure& closure) const;
  [[nodiscard]] bool agree(const LoopClosure& a, const LoopClosure& b,
                           std::span<const Pose2> poses) const;
  /// Views that are no candidates for a closure with the node.
  [[nodiscard]] std::vector<ViewId> excluded_for(std::span<const PassedNode> nodes,
                                                 std::size_t node) const;
  [[nodiscard]] std::optional<std::size_t> node_of(std::span<const PassedNode> nodes,
                                                   ViewId view) const;

  const VisualMemory* memory_;
  LoopClosureOptions options_;
  VisualOdometryOptions odometry_;
  ClosureScope scope_;
  double closed_way_m_ = 0.0;  // where the last closure was
  struct Pending {
    LoopClosure closure;
    bool told = false;
  };
  std::deque<Pending> pending_;  // of the last views, oldest first
};

}  // namespace panonav
