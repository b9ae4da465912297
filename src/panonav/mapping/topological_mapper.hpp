#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/mapping/loop_closure.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/mapping/visual_odometry.hpp"

namespace panonav {

/// Which views become nodes, and how nodes are joined.
struct MappingOptions {
  /// A view becomes a node when it differs from the last node by more (`image_difference`, 0 .. 1):
  /// capture by threshold, as in F11's second set. 0 keeps every view.
  double capture_difference = 0.0;
  bool close_loops = true;  ///< search for places passed before
  /// Assumed length of a step that neither views nor wheels give, straight ahead and with a
  /// standard deviation of its own length: for recordings whose images are far apart. 0: a new
  /// connected component begins.
  double bridge_m = 0.0;
  /// Steps come from the wheels where these are known: length and direction are theirs, and the
  /// turn is the mean of theirs and that of the views, weighted by their variances. The error of
  /// the views' turns is learnt from the last steps: the part of their difference that the wheels'
  /// own error, that of `OdometryNoise`, does not explain.
  bool wheels = true;
  /// Standard deviation of the position after a step read from views, for each metre of it.
  double step_deviation = 0.08;
  /// Standard deviation of the heading after a step (rad).
  double turn_deviation = 0.02;
};
void visit_options(MappingOptions& options, OptionVisitor& visitor);

/// Makes a map from one view after the other: a node for each, linked with the one before by visual
/// odometry; loops are closed by `LoopClosureOptions`. A closure moves the nodes since the
/// closure before so that they fit the older map. Where a contradiction remains and the map has
/// grown by a hundredth since the last time, the whole is optimised as a pose graph. The cost of a
/// view therefore stays small in large maps. Where neither views nor wheels give a step, a new
/// connected component begins with a frame of its own, unless it is bridged; a closure joins it
/// with the others.
class TopologicalMapper {
 public:
  /// The changes of the map by one view.
  struct Update {
    std::optional<VisualStep> step;     ///< from the node before
    bool new_component = false;         ///< no step connects the view with the node before
    std::vector<LoopClosure> closures;  ///< that became certain; numbers of nodes
    bool optimised = false;             ///< the whole map was optimised
  };

  /// `memory` must outlive the mapper. Throws OptionError.
  explicit TopologicalMapper(const VisualMemory& memory, const MappingOptions& options = {},
                             const VisualOdometryOptions& odometry = {},
                             const LoopClosureOptions& closure = {},
                             const PoseGraphOptions& graph = {});
  /// The source of a move may only be destroyed or assigned to.
  TopologicalMapper(TopologicalMapper&&) noexcept;
  TopologicalMapper& operator=(TopologicalMapper&&) noexcept;
  ~TopologicalMapper();

  /// True if the view differs enough from the last node to become one.
  [[nodiscard]] bool is_new(const OdometryView& view) const;

  /// Adds a node. The view must be the memory's latest; `moved`: motion by the wheels since the
  /// last node (robot_old_from_robot_new), nullopt without wheels. Throws ContractError on a view
  /// that is not in the memory or not later than those before, on another shape, and on a step that
  /// is not finite.
  Update add(ViewId view, OdometryView image, const std::optional<Pose2>& moved = std::nullopt);

  /// Optimises the map if it has changed since the last time.
  void finish();

  [[nodiscard]] std::size_t size() const noexcept;  ///< Number of nodes.
  /// The pose of each node, in the frame of its connected component.
  [[nodiscard]] std::span<const Pose2> poses() const noexcept;
  /// The map, with components numbered in the order of their first nodes.
  [[nodiscard]] TopologicalMap map() const;
  /// Metric scale of visual displacements: from the wheels, or else from the visual odometry.
  [[nodiscard]] double scale_m() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
