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

/// The reference views and the edges between them. Nodes are numbers 0 .. size() - 1 in the
/// order of their views. Holds no signatures, about 100 bytes an edge. Immutable.
class NavigationGraph {
 public:
  /// Two reference views between which a robot can move, both ways.
  struct Edge {
    ViewId a;  ///< one end
    ViewId b;  ///< the other
    /// What the way costs, > 0; in whatever unit the graph has.
    double length = 1.0;
    /// How b lies to a, in the graph's unit. Empty: nothing tells. At the same place, x and y are
    /// 0: no direction is meant.
    std::optional<Pose2> a_from_b;
    friend bool operator==(const Edge&, const Edge&) = default;
  };

  /// `views` ascend. Of several edges between two views the first counts. Throws ContractError
  /// on an edge of a view that is not there or to itself, or numbers that are not finite or out
  /// of range.
  NavigationGraph(std::vector<ViewId> views, std::vector<Edge> edges);

  /// An edge as seen from one of its ends.
  struct Exit {
    std::size_t node = 0;  ///< where it leads
    std::size_t edge = 0;  ///< its number
  };
  [[nodiscard]] std::size_t size() const noexcept { return views_.size(); }  ///< Number of nodes.
  /// Of all nodes, ascending.
  [[nodiscard]] std::span<const ViewId> views() const noexcept { return views_; }
  /// Of one node. Throws std::out_of_range on a number that is none.
  [[nodiscard]] ViewId view(std::size_t node) const { return views_.at(node); }
  /// Empty when there is no such view.
  [[nodiscard]] std::optional<std::size_t> node_of(ViewId view) const;
  /// Each once; edges are numbered in this order.
  [[nodiscard]] std::span<const Edge> edges() const noexcept { return edges_; }
  /// Ascending by node.
  [[nodiscard]] std::span<const Exit> exits(std::size_t node) const {
    return std::span(exits_).subspan(begins_[node], begins_[node + 1] - begins_[node]);
  }
  /// How the far end of an edge lies to `node`, one of its ends: node_from_other.
  [[nodiscard]] std::optional<Pose2> motion_from(std::size_t node, std::size_t edge) const;

 private:
  std::vector<ViewId> views_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> begins_;
  std::vector<Exit> exits_;
};

/// The nodes that at most `links` edges lie away from one of `from`, these included; ascending.
[[nodiscard]] std::vector<std::size_t> nodes_around(const NavigationGraph& graph,
                                                    std::span<const std::size_t> from, int links);

/// The two views of an edge must agree on its direction to this [mapping/lattice.hpp].
inline constexpr double max_disagreement_rad = 0.78539816339744831;

/// An edge for each link, read from the phases of its two views by their home vectors [M04
/// section 3.5]: no position is looked at. Lengths are in units of R, the typical distance of the
/// things around, and at least a tenth of their median. Where the answers of both views differ by
/// more than 45 degrees, or not more than half of the triangles with third views close to that, as
/// `arrange` asks, nothing is told: the edge counts as three times the median length. No more than
/// some thousand views are held at once. Throws ContractError on a link of a view that the source
/// has not. Cost: two home vectors a link, about a millisecond.
[[nodiscard]] NavigationGraph graph_from_links(const ViewSource& source,
                                               std::span<const Link> links, Executor& executor);

/// An edge for each edge of a map within one component whose weight is at least `min_weight`: what
/// lies below contradicts the rest of the map. Motions and lengths follow from the poses. Throws
/// ContractError as `validate`.
[[nodiscard]] NavigationGraph graph_from_map(const TopologicalMap& map, double min_weight = 0.1);

/// The same, and edges between nodes of one component that lie side by side in the map, up to one
/// and a half of the median length of its edges, when their views look as alike as those of most
/// edges and agree on a direction: a robot that comes by a place for the second time goes on as it
/// went the first time. The memory must hold the map's views. Cost: a home vector and a half for
/// each such pair.
[[nodiscard]] NavigationGraph graph_from_map_and_neighbours(const TopologicalMap& map,
                                                            const VisualMemory& memory,
                                                            Executor& executor,
                                                            double min_weight = 0.1);

/// An edge for each spring that kept `min_weight` of itself and is no longer than two spacings
/// of the references around, or that three third views confirm though the arrangement gave it up
/// (one and a half spacings), if its ends have about a quarter of their neighbours in common:
/// others lead to places that look alike. Of those that are left out thereby, the ones without
/// which components of the lattice would not be joined. Directions and turns follow from the phases
/// of the two views, so that the distortion of the arrangement bends none of them. Lengths, in
/// spacings of the references around, are those of the arrangement, and of the phases where it gave
/// the spring up. Cost: the springs times those of a view.
[[nodiscard]] NavigationGraph graph_from_lattice(const Lattice& lattice, double min_weight = 0.1);

/// The same of a lattice that was stored as a map (`map_of`): the phases are read anew from the
/// views, with the support that the edges of links need. Throws ContractError as `validate`, and
/// on a view that the source has not. Cost: two home vectors an edge.
[[nodiscard]] NavigationGraph graph_from_stored_lattice(const TopologicalMap& arrangement,
                                                        const ViewSource& source,
                                                        Executor& executor,
                                                        double min_weight = 0.1);

}  // namespace panonav
