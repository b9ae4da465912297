#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav_recordings/run_recorder.hpp"

namespace panonav::command {

/// The nodes and edges of one connected component, as components have no common frame. `names`: of
/// the nodes.
void add_component(recordings::RunMoment& moment, const TopologicalMap& map, std::size_t component,
                   const std::vector<std::string>& names);

/// Shows a map while it grows: the connected component of the newest node.
class GrowingMap {
 public:
  /// Adds the map after this observation to the moment; `is_node`: the observation became a node.
  /// Nodes and edges are sent after a loop closure or when a twentieth of the nodes is new. The
  /// truth is moved into the frame of the map by the first node of the component; without a heading
  /// there is no truth.
  void add_to(recordings::RunMoment& moment, const TopologicalMap& map, bool is_node,
              const std::string& name);
  /// The finished map: its largest component.
  void finish(recordings::RunMoment& moment, const TopologicalMap& map) const;

 private:
  void transform_to_component(recordings::RunMoment& moment, const TopologicalMap& map,
                              std::size_t component) const;

  std::vector<std::string> names_;                    // of the nodes
  std::vector<std::optional<ReferencePose>> truths_;  // of the nodes
  std::optional<ReferencePose> truth_;                // of the last observation
  bool last_is_node_ = false;
  std::size_t shown_nodes_ = 0;
  std::size_t shown_closures_ = 0;
};

}  // namespace panonav::command
