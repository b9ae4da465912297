#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav_recordings/run_recorder.hpp"

namespace panonav::command {

/// Adds the nodes and edges of one connected component to the moment; components have no common
/// frame. `names` are the names of all nodes of the map.
void add_component(recordings::RunMoment& moment, const TopologicalMap& map, std::size_t component,
                   const std::vector<std::string>& names);

/// Returns a map as pages show it: in view steps, the median step has length 1.
[[nodiscard]] TopologicalMap to_shown_lengths(TopologicalMap map, LengthUnit unit);
/// Sets the unit of the moment's positions.
void set_unit(recordings::RunMoment& moment, LengthUnit unit);

/// Shows a map while it grows: the connected component of the newest node.
class GrowingMap {
 public:
  /// Adds the map after this observation to the moment, as `to_shown_lengths`. `is_node` is true if
  /// the observation became a node. Nodes and edges are added after a loop closure or if 5 % of the
  /// nodes are new. The true pose is transformed to the map's frame with the first node of the
  /// component, or removed if a heading is unknown or the map is in view steps.
  void add_to(recordings::RunMoment& moment, const TopologicalMap& grown, LengthUnit unit,
              bool is_node, const std::string& name);
  /// Adds the largest component of the finished map to the moment.
  void finish(recordings::RunMoment& moment, const TopologicalMap& finished, LengthUnit unit) const;

 private:
  void transform_to_component(recordings::RunMoment& moment, const TopologicalMap& map,
                              LengthUnit unit, std::size_t component) const;

  std::vector<std::string> names_;                    // one per node
  std::vector<std::optional<ReferencePose>> truths_;  // true poses, one per node
  std::optional<ReferencePose> truth_;                // true pose of the last observation
  bool last_is_node_ = false;
  std::size_t shown_node_count_ = 0;
  std::size_t shown_closure_count_ = 0;
};

}  // namespace panonav::command
