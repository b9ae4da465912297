#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A measured motion between two nodes of a map.
struct PoseEdge {
  std::size_t a = 0;                    ///< index of a node
  std::size_t b = 0;                    ///< index of another node
  Pose2 a_from_b;                       ///< as measured
  double position_deviation_m = 0.1;    ///< standard deviation of x and of y, > 0
  double heading_deviation_rad = 0.05;  ///< above 0
  /// True if the edge may be an outlier, such as a loop closure; its weight then falls if other
  /// edges contradict it.
  bool doubtful = false;
  friend bool operator==(const PoseEdge&, const PoseEdge&) = default;
};

/// Options for the end of the optimisation and for outliers.
struct PoseGraphOptions {
  int max_iterations = 40;  ///< steps of the solver, >= 1
  /// Largest change of a position, in metres, at which the optimisation has converged.
  double settled_m = 1e-3;
  /// Error in standard deviations at which the weight of a doubtful edge has fallen to a quarter.
  double doubt_deviations = 5.0;
};
void visit_options(PoseGraphOptions& options, OptionVisitor& visitor);

/// The result of an optimisation.
struct PoseGraphReport {
  int iterations = 0;                ///< steps made
  bool settled = true;               ///< false: `max_iterations` were not enough
  double cost = 0.0;                 ///< final half weighted sum of squares
  std::vector<double> edge_weights;  ///< one per edge, 0 .. 1; 1 for edges that are not doubtful
};

/// Optimises the poses of `nodes`: Gauss-Newton on the sparse normal equations. Doubtful edges have
/// a robust cost (Geman and McClure), which starts as the quadratic cost and is narrowed
/// gradually, so that drift does not reject the first closure. Nodes without edges, those whose
/// entry in `fixed` is not 0, and the first node of each component without a fixed one do not move.
/// Deterministic. Throws OptionError; ContractError on an edge to an absent node or to itself, a
/// value that is not finite, a deviation not above 0, or `fixed` of another size, unless empty.
/// Cost: 10 ms an iteration for a path of 10,000 nodes.
PoseGraphReport optimise_pose_graph(std::span<Pose2> nodes, std::span<const PoseEdge> edges,
                                    const PoseGraphOptions& options = {},
                                    std::span<const std::uint8_t> fixed = {});

/// Returns the connected component of each node, numbered from 0 in the order of their first nodes.
[[nodiscard]] std::vector<std::size_t> connected_components(std::size_t nodes,
                                                            std::span<const PoseEdge> edges);

/// Returns the residual of an edge at the nodes' poses, in standard deviations. The edge must be
/// valid.
[[nodiscard]] double normalised_residual(const PoseEdge& edge, std::span<const Pose2> nodes);

}  // namespace panonav
