#include "panonav/mapping/pose_graph.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "panonav/core/disjoint_sets.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav {

namespace {

constexpr std::size_t unknowns = 3;  // x, y, heading of each node

void validate_graph(std::span<const Pose2> nodes, std::span<const PoseEdge> edges) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!is_finite(nodes[i])) {
      throw ContractError("node " + std::to_string(i), "not finite", "a finite pose");
    }
  }
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const PoseEdge& edge = edges[i];
    const std::string name = "edge " + std::to_string(i);
    if (edge.a >= nodes.size() || edge.b >= nodes.size() || edge.a == edge.b) {
      throw ContractError(name, std::to_string(edge.a) + " to " + std::to_string(edge.b),
                          "two different nodes of " + std::to_string(nodes.size()));
    }
    if (!is_finite(edge.a_from_b)) throw ContractError(name, "not finite", "a finite pose");
    require(std::isfinite(edge.position_deviation_m) && edge.position_deviation_m > 0.0,
            name + ": position_deviation_m", edge.position_deviation_m, "> 0");
    require(std::isfinite(edge.heading_deviation_rad) && edge.heading_deviation_rad > 0.0,
            name + ": heading_deviation_rad", edge.heading_deviation_rad, "> 0");
  }
}

struct EdgeError {
  double x = 0.0;
  double y = 0.0;
  double heading = 0.0;
};

// Returns the error in the frame of node a, in standard deviations.
EdgeError compute_edge_error(const PoseEdge& edge, const Pose2& a, const Pose2& b) {
  const Pose2 present = inverse(a) * b;
  const double position = 1.0 / edge.position_deviation_m;
  return {position * (present.x_m - edge.a_from_b.x_m),
          position * (present.y_m - edge.a_from_b.y_m),
          angle_difference(present.heading_rad, edge.a_from_b.heading_rad) /
              edge.heading_deviation_rad};
}

double squared_norm(const EdgeError& error) {
  return error.x * error.x + error.y * error.y + error.heading * error.heading;
}

/// Returns 1 for each fixed node: those of `fixed`, and the first node of each component without a
/// fixed one.
std::vector<std::uint8_t> choose_fixed_nodes(std::size_t nodes, std::span<const PoseEdge> edges,
                                             std::span<const std::uint8_t> fixed) {
  std::vector<std::uint8_t> all_fixed(nodes, 0);
  std::ranges::copy(fixed, all_fixed.begin());
  const auto components = connected_components(nodes, edges);
  std::vector<std::uint8_t> has_fixed_node(nodes, 0);  // by component
  for (std::size_t i = 0; i < nodes; ++i) has_fixed_node[components[i]] |= all_fixed[i];
  for (std::size_t i = 0; i < nodes; ++i) {
    if (has_fixed_node[components[i]] != 0) continue;
    all_fixed[i] = 1;
    has_fixed_node[components[i]] = 1;
  }
  return all_fixed;
}

/// The graph as a problem for `minimise`. Each step narrows the loss of doubtful edges (graduated
/// non-convexity).
class Graph {
 public:
  Graph(std::span<Pose2> nodes, std::span<const PoseEdge> edges,
        std::span<const std::uint8_t> fixed, const PoseGraphOptions& options)
      : nodes_(nodes),
        edges_(edges),
        options_(options),
        final_scale_(options.doubt_deviations * options.doubt_deviations),
        weights_(edges.size(), 1.0),
        fixed_(choose_fixed_nodes(nodes.size(), edges, fixed)) {
    // Every edge has full weight in the first steps.
    const bool doubtful = std::ranges::any_of(edges, &PoseEdge::doubtful);
    scale_ = doubtful ? std::numeric_limits<double>::infinity() : final_scale_;
  }

  bool linearise(SparseEquations& equations) {
    equations.reset(static_cast<int>(nodes_.size() * unknowns));
    for (std::size_t i = 0; i < nodes_.size() * unknowns; ++i) {
      // A small diagonal entry keeps nodes in place whose edges have almost no weight.
      const double diagonal = fixed_[i / unknowns] != 0 ? 1.0 : 1e-9;
      equations.add(static_cast<int>(i), static_cast<int>(i), diagonal);
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) add_edge(i, equations);
    for (std::size_t i = 0; i < nodes_.size() * unknowns; ++i) {
      if (fixed_[i / unknowns] != 0) equations.right(static_cast<int>(i)) = 0.0;
    }
    equations.assemble();
    return true;
  }

  /// Moves the nodes and updates the weights. True if all weights are final and no pose moved.
  bool move(const Eigen::VectorXd& change) {
    ++steps_;
    const double moved = move_nodes(change);
    if (std::isinf(scale_)) {
      // Positions need not be exact before the first change of the weights.
      constexpr double nearly_settled_m = 0.05;
      if (moved > nearly_settled_m && steps_ < options_.max_iterations / 4) return false;
      scale_ = std::max(final_scale_, update_weights());
    } else if (scale_ > final_scale_) {
      scale_ = std::max(final_scale_, 0.25 * scale_);
    } else if (moved <= options_.settled_m) {
      return true;
    }
    update_weights();
    return false;
  }

  [[nodiscard]] double half_cost() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < edges_.size(); ++i)
      sum += weights_[i] * squared_norm(edge_error(i));
    return 0.5 * sum;
  }
  [[nodiscard]] const std::vector<double>& weights() const { return weights_; }

 private:
  /// Sets the weights of doubtful edges from the ratio of their squared errors to `scale_`. Returns
  /// the largest squared error of a doubtful edge.
  double update_weights() {
    double largest = 0.0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (!edges_[i].doubtful) continue;
      const double error = squared_norm(edge_error(i));
      largest = std::max(largest, error);
      const double root = scale_ / (scale_ + error);
      weights_[i] = std::isfinite(scale_) ? root * root : 1.0;
    }
    return largest;
  }

  /// Moves the nodes; returns the largest change of a coordinate (m) or a heading (rad).
  double move_nodes(const Eigen::VectorXd& change) {
    double largest = 0.0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (fixed_[i] != 0) continue;
      const auto at = static_cast<Eigen::Index>(i * unknowns);
      // Headings change by at most half a radian at once, as far as the linear model holds.
      const double turn = std::clamp(change[at + 2], -0.5, 0.5);
      nodes_[i] = {nodes_[i].x_m + change[at], nodes_[i].y_m + change[at + 1],
                   wrap_angle(nodes_[i].heading_rad + turn)};
      largest = std::max({largest, std::abs(change[at]), std::abs(change[at + 1]), std::abs(turn)});
    }
    return largest;
  }

  [[nodiscard]] EdgeError edge_error(std::size_t i) const {
    return compute_edge_error(edges_[i], nodes_[edges_[i].a], nodes_[edges_[i].b]);
  }

  void add_edge(std::size_t i, SparseEquations& equations) const {
    const PoseEdge& edge = edges_[i];
    const Pose2& a = nodes_[edge.a];
    const Pose2& b = nodes_[edge.b];
    const EdgeError error = compute_edge_error(edge, a, b);
    const double weight = weights_[i];
    const double p = 1.0 / edge.position_deviation_m;
    const double h = 1.0 / edge.heading_deviation_rad;
    const double c = std::cos(a.heading_rad);
    const double s = std::sin(a.heading_rad);
    const double dx = b.x_m - a.x_m;
    const double dy = b.y_m - a.y_m;
    // Columns: x, y and heading of a, then of b.
    constexpr std::size_t columns = 6;
    const std::array<std::array<double, columns>, 3> jacobian{{
        {-p * c, -p * s, p * (c * dy - s * dx), p * c, p * s, 0.0},
        {p * s, -p * c, p * (-c * dx - s * dy), -p * s, p * c, 0.0},
        {0.0, 0.0, -h, 0.0, 0.0, h},
    }};
    const std::array<double, 3> residual{error.x, error.y, error.heading};
    const auto index = [&](std::size_t column) {
      return column < unknowns ? edge.a * unknowns + column : edge.b * unknowns + column - unknowns;
    };
    for (std::size_t m = 0; m < columns; ++m) {
      double slope = 0.0;
      for (std::size_t r = 0; r < 3; ++r) slope += jacobian[r][m] * residual[r];
      equations.right(static_cast<int>(index(m))) -= weight * slope;
      for (std::size_t n = 0; n <= m; ++n) {
        double sum = 0.0;
        for (std::size_t r = 0; r < 3; ++r) sum += jacobian[r][m] * jacobian[r][n];
        // The equations of fixed poses stay x = 0, so that the sparsity pattern does not change.
        const bool stays = fixed_[index(m) / unknowns] != 0 || fixed_[index(n) / unknowns] != 0;
        equations.add(static_cast<int>(index(m)), static_cast<int>(index(n)),
                      stays ? 0.0 : weight * sum);
      }
    }
  }

  std::span<Pose2> nodes_;
  std::span<const PoseEdge> edges_;
  const PoseGraphOptions& options_;
  double final_scale_;  // squared deviations
  double scale_ = 0.0;
  int steps_ = 0;
  std::vector<double> weights_;
  std::vector<std::uint8_t> fixed_;
};

}  // namespace

void visit_options(PoseGraphOptions& options, OptionVisitor& visitor) {
  using T = PoseGraphOptions;
  constexpr OptionTable table{
      option<&T::max_iterations>("largest number of steps of the solver", 1, 1000),
      option<&T::settled_m>("the solver stops when no position changes by more than this", above(0),
                            1e6),
      option<&T::doubt_deviations>(
          "error of a loop closure above which its weight decreases, in standard deviations",
          above(0), 1e6),
  };
  table.visit(options, visitor);
}

PoseGraphReport optimise_pose_graph(std::span<Pose2> nodes, std::span<const PoseEdge> edges,
                                    const PoseGraphOptions& options,
                                    std::span<const std::uint8_t> fixed) {
  validate(options);
  validate_graph(nodes, edges);
  require(fixed.empty() || fixed.size() == nodes.size(), "entries of fixed",
          static_cast<double>(fixed.size()), "none, or as many as nodes");
  PoseGraphReport report;
  report.edge_weights.assign(edges.size(), 1.0);
  if (edges.empty()) return report;
  Graph problem(nodes, edges, fixed, options);
  SparseEquations equations;
  const LeastSquaresReport solved =
      minimise(problem, equations, {.max_steps = options.max_iterations});
  report.iterations = solved.steps;
  report.settled = solved.converged;
  report.cost = problem.half_cost();
  report.edge_weights = problem.weights();
  return report;
}

std::vector<std::size_t> connected_components(std::size_t nodes, std::span<const PoseEdge> edges) {
  DisjointSets sets(nodes);
  for (const PoseEdge& edge : edges) sets.join(edge.a, edge.b);
  return sets.number_sets();
}

double normalised_residual(const PoseEdge& edge, std::span<const Pose2> nodes) {
  return std::sqrt(squared_norm(compute_edge_error(edge, nodes[edge.a], nodes[edge.b])));
}

}  // namespace panonav
