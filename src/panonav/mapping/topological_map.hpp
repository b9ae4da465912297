#pragma once

#include <cstddef>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A map of places [F11 section 4] with closed loops.
struct TopologicalMap {
  /// A node of the map: a view and its pose.
  struct Node {
    ViewId view;                ///< an id of the memory
    Pose2 pose;                 ///< in the frame of its connected component
    std::size_t component = 0;  ///< its connected component; components have no common frame
    friend bool operator==(const Node&, const Node&) = default;
  };
  /// Two nodes and the motion between them.
  struct Edge {
    ViewId a;                                ///< one node, by its view
    ViewId b;                                ///< the other
    Pose2 a_from_b;                          ///< pose of b in the frame of a, metres
    Link::Kind kind = Link::Kind::sequence;  ///< of the edge
    double weight = 1.0;  ///< 0 .. 1; small where the rest of the map contradicts a closure
    friend bool operator==(const Edge&, const Edge&) = default;
  };

  std::vector<Node> nodes;  ///< ascending by view
  std::vector<Edge> edges;  ///< each joins two nodes of the map
  friend bool operator==(const TopologicalMap&, const TopologicalMap&) = default;
};

/// Throws ContractError unless nodes ascend by view, component numbers are below the number of
/// nodes, edges join two different nodes of the map, all poses are finite and all weights are in
/// [0, 1].
void validate(const TopologicalMap& map);

/// Numbers the connected components from 0 without gaps, in their order.
void renumber_components(TopologicalMap& map);

/// The number of connected components.
[[nodiscard]] std::size_t count_components(const TopologicalMap& map);

/// Returns the number of nodes of each component.
[[nodiscard]] std::vector<std::size_t> count_nodes(const TopologicalMap& map);

}  // namespace panonav
