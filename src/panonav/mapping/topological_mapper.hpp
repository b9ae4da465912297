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

/// Options for the views that become nodes and for the connections between nodes.
struct MappingOptions {
  /// Smallest difference from the last node (`image_difference`, 0 .. 1) at which a view becomes a
  /// node: capture by threshold, as in the second set of F11. 0 keeps every view.
  double capture_difference = 0.0;
  bool close_loops = true;  ///< search for loop closures
  /// Length in metres of the straight step that is assumed where neither views nor wheels give one;
  /// its standard deviation is equal to it. For recordings whose images are far apart. 0: a new
  /// connected component begins instead.
  double bridge_m = 0.0;
  /// Use the motion of the wheels where it is known. Once ten loop closures have shown the errors
  /// of the wheels, turns are the means of wheels and views, weighted by their inverse variances.
  /// The variance of the views' turns is learnt from the latest steps: the squared difference to
  /// the wheels' turns less the variance of the wheels.
  bool wheels = true;
  /// Standard deviation of the position after a step from views, in metres per metre of the step.
  double step_deviation = 0.08;
  /// Standard deviation of the heading after a step from views, in rad per metre of the step.
  double turn_deviation = 0.02;
};
void visit_options(MappingOptions& options, OptionVisitor& visitor);

/// Builds a map from successive views: each becomes a node, connected to the previous node by
/// visual odometry or wheels. A loop closure (`LoopClosureOptions`) must be one that the path
/// between its nodes allows (three standard deviations), with the errors of steps that earlier
/// closures have shown; it moves only the nodes since the last closure. If a contradiction remains
/// and the map has grown by 1 % since its last full optimisation, the whole map is optimised as a
/// pose graph. Where neither views nor wheels
/// give a step and none is assumed (`bridge_m`), a new connected component with its own frame
/// begins, which a later closure can join with another one.
class TopologicalMapper {
 public:
  /// The changes of the map by one view.
  struct Update {
    std::optional<VisualStep> step;     ///< from the node before
    bool new_component = false;         ///< no step connects the view with the node before
    std::vector<LoopClosure> closures;  ///< closures that became certain, with indices of nodes
    bool optimised = false;             ///< the whole map was optimised
  };

  /// `memory` must outlive the mapper. Throws OptionError.
  explicit TopologicalMapper(const VisualMemory& memory, const MappingOptions& options = {},
                             const VisualOdometryOptions& odometry = {},
                             const LoopClosureOptions& closure = {},
                             const PoseGraphOptions& graph = {});
  /// A moved-from mapper may only be destroyed or assigned to.
  TopologicalMapper(TopologicalMapper&&) noexcept;
  TopologicalMapper& operator=(TopologicalMapper&&) noexcept;
  ~TopologicalMapper();

  /// True if the view differs enough from the last node to become one.
  [[nodiscard]] bool is_new(const OdometryView& view) const;

  /// Adds a node. The view must be the memory's latest; `moved`: motion by the wheels since the
  /// node that is `moved_nodes` before this one (robot_old_from_robot_new), nullopt without wheels;
  /// more than 1 if the wheels were not known at the nodes between. Throws ContractError on a view
  /// that is not in the memory or not later than those before, on another shape, on a step that is
  /// not finite, and on a node before the first.
  Update add(ViewId view, OdometryView image, const std::optional<Pose2>& moved = std::nullopt,
             std::size_t moved_nodes = 1);

  /// Begins a new path: the next view does not follow the last one, and so begins a new connected
  /// component unless its motion is given. Its turns and speed are learnt again.
  void begin_path();

  /// Closes the loops that the last views of a path make certain, and optimises the map if it has
  /// changed since the last time.
  void finish();

  [[nodiscard]] std::size_t size() const noexcept;  ///< Number of nodes.
  /// The pose of each node, in the frame of its connected component.
  [[nodiscard]] std::span<const Pose2> poses() const noexcept;
  /// The map, with components numbered in the order of their first nodes.
  [[nodiscard]] TopologicalMap map() const;
  /// Metric scale of visual displacements: from the wheels, or else from the visual odometry.
  [[nodiscard]] double scale_m() const;
  /// True if the scale was measured: by wheels or from the ground.
  [[nodiscard]] bool is_metric() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
