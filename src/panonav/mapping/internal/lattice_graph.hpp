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

  /// What an edge leads to.
  struct Neighbour {
    std::size_t node;  ///< at the other end of the edge
    std::size_t edge;  ///< its place among the edges given
    double length;     ///< of the edge
  };
  /// Number of nodes.
  [[nodiscard]] std::size_t size() const noexcept { return begins_.size() - 1; }
  /// Ends of the edges at a node, which the caller guarantees to be there.
  [[nodiscard]] std::span<const Neighbour> neighbours(std::size_t node) const {
    return std::span(neighbours_).subspan(begins_[node], begins_[node + 1] - begins_[node]);
  }

  /// Number of each node's connected component. Components are numbered by size, the largest first,
  /// then by their first node.
  [[nodiscard]] std::vector<std::size_t> components() const;

  /// Length of the shortest path from `from` to every node, infinite where there is none
  /// (Dijkstra).
  [[nodiscard]] std::vector<double> shortest_ways(std::size_t from) const;

 private:
  std::vector<std::size_t> begins_;
  std::vector<Neighbour> neighbours_;
};

}  // namespace panonav
