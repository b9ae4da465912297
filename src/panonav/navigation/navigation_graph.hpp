#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/view_source.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Graph of reference views and the edges between them. Nodes are numbered from 0 in the order of
/// their views. Holds no signatures, only about 100 bytes for each edge. Immutable.
class NavigationGraph {
 public:
  /// Two reference views between which a robot can move in both directions.
  struct Edge {
    ViewId a;             ///< one end
    ViewId b;             ///< the other
    double length = 1.0;  ///< path length > 0, in the graph's unit
    /// Pose of b in the frame of a, in the graph's unit; nullopt if unknown. x and y are 0 for two
    /// views of one place, which have no direction.
    std::optional<Pose2> a_from_b;
    /// True between two components of an arrangement (`Lattice::Crossing`), which the robot crosses
    /// by homing.
    bool is_crossing = false;
    friend bool operator==(const Edge&, const Edge&) = default;
  };
  /// An edge that leaves a node.
  struct Exit {
    std::size_t node = 0;  ///< node at the other end of the edge
    std::size_t edge = 0;  ///< number of the edge
  };

  /// `views`: ascending. Of several edges between two views, uses the first. Throws ContractError
  /// if an edge has an unknown view or joins a view to itself, or if a number is not finite or
  /// out of range.
  NavigationGraph(std::vector<ViewId> views, std::vector<Edge> edges);

  [[nodiscard]] std::size_t size() const noexcept { return views_.size(); }  ///< Number of nodes.
  /// The views of all nodes, ascending.
  [[nodiscard]] std::span<const ViewId> views() const noexcept { return views_; }
  /// The view of one node. Throws std::out_of_range when there is no such node.
  [[nodiscard]] ViewId view(std::size_t node) const { return views_.at(node); }
  /// The node of a view; nullopt when there is no such view.
  [[nodiscard]] std::optional<std::size_t> node_of(ViewId view) const;
  /// Each edge once, in the order of their numbers.
  [[nodiscard]] std::span<const Edge> edges() const noexcept { return edges_; }
  /// The edges of a node, ascending by the node at their other end.
  [[nodiscard]] std::span<const Exit> exits(std::size_t node) const {
    return std::span(exits_).subspan(exit_begins_[node],
                                     exit_begins_[node + 1] - exit_begins_[node]);
  }
  /// Pose of an edge's other end in the frame of `node`, one of its ends: node_from_other.
  [[nodiscard]] std::optional<Pose2> motion_from(std::size_t node, std::size_t edge) const;

 private:
  std::vector<ViewId> views_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> exit_begins_;
  std::vector<Exit> exits_;
};

/// Returns the nodes at most `links` edges away from one of the nodes `from`, including them;
/// ascending.
[[nodiscard]] std::vector<std::size_t> nodes_around(const NavigationGraph& graph,
                                                    std::span<const std::size_t> from, int links);

/// Largest difference between the directions of an edge as computed from its two views: 45
/// degrees, as in `arrange`.
inline constexpr double max_disagreement_rad = 0.78539816339744831;

/// Computes an edge for each link from the phases of its two views by their home vectors [M04
/// section 3.5], without any position. Lengths are in units of R, the typical distance of the
/// objects around, and at least a tenth of their median. The motion is unknown and the length three
/// times the median in two cases: the views disagree by more than 45 degrees, or at most half of
/// the triangles with third views close within 45 degrees. Holds at most a few thousand views at
/// once. Throws ContractError on a link of a view that the source does not have. Cost: two home
/// vectors for each link.
[[nodiscard]] NavigationGraph graph_from_links(const ViewSource& source,
                                               std::span<const Link> links, Executor& executor);

/// Uses the edges of a map that lie within one component and have at least the weight `min_weight`;
/// edges of smaller weight contradict the rest of the map. Computes motions and lengths from the
/// poses. Throws ContractError like `validate`.
[[nodiscard]] NavigationGraph graph_from_map(const TopologicalMap& map, double min_weight = 0.1);

/// Like `graph_from_map`, but also joins near nodes of one component, so that a robot that passes a
/// place for the second time can continue as it did the first time. Their distance in the map must
/// be at most 1.5 times the median length of its edges, their views must be as similar as those of
/// most edges, and the two views must agree on a direction. The memory must hold the map's views.
/// Cost: one and a half home vectors for each such pair.
[[nodiscard]] NavigationGraph make_graph_from_map_and_neighbours(const TopologicalMap& map,
                                                                 const VisualMemory& memory,
                                                                 Executor& executor,
                                                                 double min_weight = 0.1);

/// Uses the springs of weight at least `min_weight` that are at most two local spacings of the
/// references long, and rejected springs of at most one and a half spacings that three third views
/// confirm. The ends of these springs must have about a quarter of their neighbours in common,
/// since other springs lead to places that look similar. Springs left out by these rules are used
/// only if they connect components. Crossings of the lattice become edges. Directions and rotations
/// come from the phases, unchanged by a distorted arrangement. Lengths, in local spacings of the
/// references, come from the arrangement; those of rejected springs and crossings from the phases.
/// Cost: springs times springs at a view.
[[nodiscard]] NavigationGraph graph_from_lattice(const Lattice& lattice, double min_weight = 0.1);

/// Same as `graph_from_lattice` for a lattice that was stored as a map (`to_topological_map`):
/// computes the motions again from the phases of the views. Throws ContractError like `validate`,
/// and on a view that the source does not have. Cost: two home vectors for each edge.
[[nodiscard]] NavigationGraph graph_from_stored_lattice(const TopologicalMap& arrangement,
                                                        const ViewSource& source,
                                                        Executor& executor,
                                                        double min_weight = 0.1);

}  // namespace panonav
