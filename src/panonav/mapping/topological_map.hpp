#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/loop_closure.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A node of the map: a view and its pose.
struct MapNode {
  ViewId view;                ///< an id of the memory
  Pose2 pose;                 ///< in the frame of its connected component
  std::size_t component = 0;  ///< its connected component; components have no common frame
  friend bool operator==(const MapNode&, const MapNode&) = default;
};

/// Two nodes and the motion between them.
struct MapEdge {
  ViewId a;                            ///< one node, by its view
  ViewId b;                            ///< the other
  Pose2 a_from_b;                      ///< pose of b in the frame of a, metres
  LinkKind kind = LinkKind::sequence;  ///< why they are joined
  double weight = 1.0;  ///< 0 .. 1; small for a closure that the rest of the map contradicts
  friend bool operator==(const MapEdge&, const MapEdge&) = default;
};

/// A map of places [F11 section 4] with closed loops.
struct TopologicalMap {
  std::vector<MapNode> nodes;  ///< ascending by view
  std::vector<MapEdge> edges;  ///< each joins two nodes of the map
  friend bool operator==(const TopologicalMap&, const TopologicalMap&) = default;
};

/// Throws ContractError unless nodes ascend by view, their components have numbers below the number
/// of nodes, edges join two different nodes of the map, all
/// poses are finite and weights lie in 0 .. 1.
void validate(const TopologicalMap& map);

/// Gives the connected components the numbers from 0 on, in their order: some may be gone.
void renumber_components(TopologicalMap& map);

/// The number of connected components.
[[nodiscard]] std::size_t number_of_components(const TopologicalMap& map);

/// What becomes a node, and how nodes are joined.
struct MappingOptions {
  /// A view becomes a node when it differs from the last node by more (`image_difference`, 0 .. 1):
  /// capture by threshold, as in F11's second set. 0 keeps every view.
  double capture_difference = 0.0;
  bool close_loops = true;  ///< whether places passed before are looked for
  /// Where neither views nor wheels give a step, it is taken as this long, straight ahead and as
  /// uncertain as it is long: for recordings whose pictures are far apart. 0: a new connected
  /// component begins.
  double bridge_m = 0.0;
  /// Steps are taken from the wheels where these are known: length and direction are theirs, and
  /// the turn is the mean of theirs and that of the views, weighted by how far both are right. The
  /// error of the views' turns is learnt from the last steps: it is what the wheels' own error,
  /// that of `OdometryNoise`, does not explain of their difference.
  bool wheels = true;
  /// Standard deviation of the position after a step read from views, for each metre of it.
  double step_deviation = 0.08;
  /// The same of the heading (rad).
  double turn_deviation = 0.02;
};
void visit_options(MappingOptions& options, OptionVisitor& visitor);

/// What the mapper did with a view.
struct MapUpdate {
  std::optional<VisualStep> step;     ///< from the node before
  bool new_component = false;         ///< nothing connects the view with the node before
  std::vector<LoopClosure> closures;  ///< that became certain; numbers of nodes
  bool optimised = false;             ///< the whole map was
};

/// Makes a map from one view after the other: a node for each, linked with the one before by visual
/// odometry; loops are closed by `LoopClosureFinder`. A closure moves the nodes since the closure
/// before so that they fit the older map. Where a contradiction remains and the map has grown by a
/// hundredth since the last time, the whole is optimised as a pose graph. The cost of a view
/// therefore stays small in large maps. Where neither views nor wheels give a step, a new connected
/// component begins with a frame of its own, unless it is bridged; a closure joins it with the
/// others.
class TopologicalMapper {
 public:
  /// `memory` must outlive the mapper. Throws OptionError.
  explicit TopologicalMapper(const VisualMemory& memory, const MappingOptions& options = {},
                             const VisualOdometryOptions& odometry = {},
                             const LoopClosureOptions& closure = {},
                             const PoseGraphOptions& graph = {});

  /// Whether the view differs enough from the last node to become one.
  [[nodiscard]] bool is_new(const OdometryView& view) const;

  /// Adds a node. The view must be the memory's latest; `moved` is what wheels say since the last
  /// node (robot_old_from_robot_new), empty where there are none. Throws ContractError on a view
  /// that is not in the memory or not later than those before, on another shape, and on a step that
  /// is not finite.
  MapUpdate add(ViewId view, OdometryView seen, const std::optional<Pose2>& moved = std::nullopt);

  /// Optimises what is not optimised yet.
  void finish();

  [[nodiscard]] std::size_t size() const noexcept { return poses_.size(); }  ///< Number of nodes.
  /// Of each node, in the frame of its connected component.
  [[nodiscard]] std::span<const Pose2> poses() const noexcept { return poses_; }
  /// Components are numbered in the order of their first nodes.
  [[nodiscard]] TopologicalMap map() const;
  /// Metres for each unit of length of the views: from the wheels, or else from the visual
  /// odometry.
  [[nodiscard]] double scale_m() const;

 private:
  void add_step(const std::optional<VisualStep>& step, const std::optional<Pose2>& moved,
                MapUpdate& update);
  /// From the node before to the latest.
  [[nodiscard]] PoseEdge wheel_step(const Pose2& moved, const std::optional<VisualStep>& step);
  void close_loops(MapUpdate& update);
  void join_components(const LoopClosure& closure);
  void optimise_latest();
  void optimise();

  const VisualMemory* memory_;
  MappingOptions options_;
  VisualOdometry odometry_;
  PoseGraphOptions graph_;
  LoopClosureFinder finder_;
  std::vector<PassedNode> nodes_;
  std::vector<Pose2> poses_;
  std::vector<PoseEdge> edges_;
  std::vector<double> weights_;
  std::vector<KnownLength> known_lengths_;
  /// The turn of the wheels less that of the views, and the variances of both as they are told.
  struct TurnDifference {
    double difference_rad, wheel_variance, view_variance;
  };
  std::vector<TurnDifference> turns_;
  std::size_t optimised_size_ = 0;  // nodes when the map was last optimised
  std::size_t anchored_ = 0;        // the latest node of the closures so far
  bool changed_ = false;            // by closures since then
  bool pulled_ = false;             // so much that the latest nodes alone cannot give way
};

}  // namespace panonav
