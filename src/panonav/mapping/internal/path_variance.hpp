#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/pose_graph.hpp"

namespace panonav {

/// Variance of the pose of one node in the frame of another, along the most certain path of edges.
struct PathVariance {
  /// Variance of x and of y; infinite if no path connects the nodes.
  double position_m2 = std::numeric_limits<double>::infinity();
  double heading_rad2 = std::numeric_limits<double>::infinity();  ///< likewise, of the heading
};

/// The variance of the pose of `node` in the frame of other nodes. An error of the heading at an
/// edge moves `node` by the error times the distance from there, so that each edge adds the same to
/// all paths, and the best ones are shortest paths (Dijkstra), which are searched only as far as
/// nodes are asked for. Upper bounds of the variances by all edges together. The edges, weights and
/// poses must outlive it.
class PathVariances {
 public:
  /// `step_factor`: factor of the variances of edges that are not doubtful; `weights`: those of
  /// doubtful edges. Cost: O(nodes + edges), without a search.
  PathVariances(std::span<const PoseEdge> edges, std::span<const double> weights,
                std::span<const Pose2> poses, std::size_t node, double step_factor);

  /// Returns the variance of the pose of `node` in the frame of `other`. Cost: O(n log n), n edges
  /// of nodes nearer than `other` that no former call has reached.
  [[nodiscard]] PathVariance in_frame_of(std::size_t other);

 private:
  void reach_neighbours(std::size_t here);

  std::span<const PoseEdge> edges_;
  std::span<const double> weights_;
  std::span<const Pose2> poses_;
  std::size_t node_;
  double step_factor_;
  std::vector<std::size_t> edges_of_nodes_;  // numbers of edges, by node
  std::vector<std::size_t> first_edge_;      // of each node, in edges_of_nodes_
  std::vector<PathVariance> variances_;
  using Reached = std::pair<double, std::size_t>;  // variance of the position, node
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next_;
};

/// Estimates the factor of the variances of steps from the errors of closures against the steps
/// between their nodes alone: the factor for which three quarters of the squared errors, in
/// standard deviations, are below what three normal errors exceed in one of four cases. It
/// withstands a few wrong closures, and includes the errors of long loops, which grow faster than
/// by chance. nullopt for fewer than ten closures whose headings are more certain than those of the
/// steps between. At least 0.01. Cost: O(closures nodes).
[[nodiscard]] std::optional<double> learn_step_factor(std::span<const PoseEdge> edges,
                                                      std::size_t nodes);

}  // namespace panonav
