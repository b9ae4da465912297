#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace panonav {

/// An undirected edge between two nodes.
struct GraphEdge {
  std::size_t a = 0;    ///< one node
  std::size_t b = 0;    ///< the other
  double length = 1.0;  ///< >= 0
};

/// A graph of nodes and edges.
class LatticeGraph {
 public:
  /// Throws ContractError on a node that is not below `nodes` or a length below 0.
  LatticeGraph(std::size_t nodes, std::span<const GraphEdge> edges);

  /// An edge in the list of one of its nodes.
  struct Neighbour {
    std::size_t node;  ///< at the other end of the edge
    std::size_t edge;  ///< its index among those of the constructor
    double length;     ///< of the edge
  };
  /// Number of nodes.
  [[nodiscard]] std::size_t size() const noexcept { return begins_.size() - 1; }
  /// The edges of a node. The caller guarantees that the node exists.
  [[nodiscard]] std::span<const Neighbour> neighbours(std::size_t node) const {
    return std::span(neighbours_).subspan(begins_[node], begins_[node + 1] - begins_[node]);
  }

  /// Returns the number of each node's connected component. Components are numbered by size, the
  /// largest first, then by their first node.
  [[nodiscard]] std::vector<std::size_t> components() const;

  /// Returns the length of the shortest path from `from` to every node, infinite where there is
  /// none (Dijkstra).
  [[nodiscard]] std::vector<double> shortest_path_lengths(std::size_t from) const;

  /// Calls visit(a, to_b, to_c, ac) for each triangle of nodes a, b and c: `to_b` is the edge from
  /// a to b, `to_c` that from b to c, and `ac` the number of the edge between a and c. Only
  /// triangles for which use_edge(a, to_b) is true are visited.
  template <class UseEdge, class Visit>
  void visit_triangles(const UseEdge& use_edge, const Visit& visit) const {
    constexpr auto none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> edge_to(size(), none);  // from a
    for (std::size_t a = 0; a < size(); ++a) {
      for (const Neighbour& to_b : neighbours(a)) edge_to[to_b.node] = to_b.edge;
      for (const Neighbour& to_b : neighbours(a)) {
        if (!use_edge(a, to_b)) continue;
        for (const Neighbour& to_c : neighbours(to_b.node)) {
          if (edge_to[to_c.node] != none) visit(a, to_b, to_c, edge_to[to_c.node]);
        }
      }
      for (const Neighbour& to_b : neighbours(a)) edge_to[to_b.node] = none;
    }
  }

 private:
  std::vector<std::size_t> begins_;
  std::vector<Neighbour> neighbours_;
};

}  // namespace panonav
