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

/// The reference views and the edges between them. Nodes are numbered from 0 in the order of their
/// views. Holds no signatures, about 100 bytes an edge. Immutable.
class NavigationGraph {
 public:
  /// Two reference views between which a robot can move in both directions.
  struct Edge {
    ViewId a;             ///< one end
    ViewId b;             ///< the other
    double length = 1.0;  ///< path length, > 0; in whatever unit the graph has
    /// Pose of b in the frame of a, in the graph's unit; nullopt where it is not known. x and y are
    /// 0 for views of one place: no direction is meant.
    std::optional<Pose2> a_from_b;
    friend bool operator==(const Edge&, const Edge&) = default;
  };
  /// An edge as seen from one of its ends.
  struct Exit {
    std::size_t node = 0;  ///< where it leads
    std::size_t edge = 0;  ///< its number
  };

  /// `views` ascend. Of several edges between two views the first counts. Throws ContractError
  /// on an edge of a view that is not there or to itself, or numbers that are not finite or out
  /// of range.
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
  /// The edges of a node, ascending by the node where they lead.
  [[nodiscard]] std::span<const Exit> exits(std::size_t node) const {
    return std::span(exits_).subspan(begins_[node], begins_[node + 1] - begins_[node]);
  }
  /// Pose of the far end of an edge in the frame of `node`, one of its ends: node_from_other.
  [[nodiscard]] std::optional<Pose2> motion_from(std::size_t node, std::size_t edge) const;

 private:
  std::vector<ViewId> views_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> begins_;
  std::vector<Exit> exits_;
};

/// Returns the nodes at most `links` edges away from one of `from`, these included; ascending.
[[nodiscard]] std::vector<std::size_t> nodes_around(const NavigationGraph& graph,
                                                    std::span<const std::size_t> from, int links);

/// Largest difference between the directions that the two views of an edge show: 45 degrees, as in
/// `arrange`.
inline constexpr double max_disagreement_rad = 0.78539816339744831;

/// Reads an edge for each link from the phases of its two views by their home vectors [M04 section
/// 3.5], without any position. Lengths are in units of R, the typical distance of the things
/// around, and at least a tenth of their median. Where the views disagree by more than 45 degrees,
/// or not more than half of the triangles with third views close to that, nothing is known of the
/// motion and the length is three times the median. At most some thousand views are held at once.
/// Throws ContractError on a link of a view that the source does not have. Cost: two home vectors a
/// link.
[[nodiscard]] NavigationGraph graph_from_links(const ViewSource& source,
                                               std::span<const Link> links, Executor& executor);

/// Takes the edges of a map within one component whose weight is at least `min_weight`: others
/// contradict the rest of the map. Motions and lengths follow from the poses. Throws ContractError
/// as `validate`.
[[nodiscard]] NavigationGraph graph_from_map(const TopologicalMap& map, double min_weight = 0.1);

/// Like `graph_from_map`, with edges also between nodes of one component that are near each other
/// in the map, up to one and a half of the median length of its edges, if their views are as
/// similar as those of most edges and agree on a direction: a robot that passes a place for the
/// second time can continue as it did the first time. The memory must hold the map's views. Cost: a
/// home vector and a half for each such pair.
[[nodiscard]] NavigationGraph graph_from_map_and_neighbours(const TopologicalMap& map,
                                                            const VisualMemory& memory,
                                                            Executor& executor,
                                                            double min_weight = 0.1);

/// Takes the springs that kept `min_weight` of themselves and are at most two spacings of the
/// references around long, and rejected ones of up to one and a half spacings that three third
/// views confirm; of these the ones whose ends have about a quarter of their neighbours in common:
/// others lead to places that look similar. Those left out thereby join what would not be connected
/// otherwise. Directions and turns follow from the phases, so that the distortion of the
/// arrangement bends none. Lengths, in spacings of the references around, are those of the
/// arrangement, of rejected springs those of the phases. Cost: the springs times those of a view.
[[nodiscard]] NavigationGraph graph_from_lattice(const Lattice& lattice, double min_weight = 0.1);

/// Same as `graph_from_lattice` for a lattice that was stored as a map (`to_topological_map`): the
/// phases are read again from the views, with the support that the edges of links need. Throws
/// ContractError as `validate`, and on a view that the source does not have. Cost: two home vectors
/// an edge.
[[nodiscard]] NavigationGraph graph_from_stored_lattice(const TopologicalMap& arrangement,
                                                        const ViewSource& source,
                                                        Executor& executor,
                                                        double min_weight = 0.1);

}  // namespace panonav
