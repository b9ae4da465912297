#include "panonav/mapping/internal/path_variance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

double squared(double value) {
  return value * value;
}

/// The steps by which each node was reached; none for the first of a component.
class StepPaths {
 public:
  StepPaths(std::span<const PoseEdge> edges, std::size_t nodes) : step_to_(nodes) {
    for (const PoseEdge& edge : edges) {
      if (!edge.doubtful) step_to_[edge.b] = &edge;
    }
  }

  /// The motion along steps and its variance.
  struct Path {
    Pose2 motion;
    PathVariance variance;
  };

  /// Returns the path from one node to a later one; nullopt if it does not lead through `from`.
  [[nodiscard]] std::optional<Path> find_path(std::size_t from, std::size_t to) const {
    Path path{{}, {0.0, 0.0}};
    while (to > from) {
      const PoseEdge* const step = step_to_[to];
      if (step == nullptr || step->a >= to) return std::nullopt;
      // The error of a heading moves the end by the distance from the step to the end.
      const double heading_rad2 = squared(step->heading_deviation_rad);
      path.variance.heading_rad2 += heading_rad2;
      path.variance.position_m2 +=
          squared(step->position_deviation_m) +
          heading_rad2 * squared(std::hypot(path.motion.x_m, path.motion.y_m));
      path.motion = step->a_from_b * path.motion;
      to = step->a;
    }
    if (to != from) return std::nullopt;
    return path;
  }

 private:
  std::vector<const PoseEdge*> step_to_;
};

/// The squared error of a closure against the steps between its nodes, and the variances of both.
struct ClosureError {
  double position_m2, heading_rad2;
  PathVariance path, closure;

  /// Returns the squared error in standard deviations.
  [[nodiscard]] double normalised(double factor) const {
    return position_m2 / (factor * path.position_m2 + closure.position_m2) +
           heading_rad2 / (factor * path.heading_rad2 + closure.heading_rad2);
  }
};

}  // namespace

std::optional<double> learn_step_factor(std::span<const PoseEdge> edges, std::size_t nodes) {
  constexpr std::size_t min_closures = 10;
  constexpr double min_step_factor = 0.01;             // a tenth of the usual deviations
  constexpr double quartile_of_three_squares = 4.108;  // of their sum, 3 of 4 are smaller
  const StepPaths paths(edges, nodes);
  std::vector<ClosureError> errors;
  for (const PoseEdge& edge : edges) {
    if (!edge.doubtful) continue;
    const auto path = paths.find_path(edge.a, edge.b);
    if (!path || path->variance.heading_rad2 < squared(edge.heading_deviation_rad)) continue;
    const double off_m = distance(path->motion.position(), edge.a_from_b.position());
    const double off_rad = angle_difference(path->motion.heading_rad, edge.a_from_b.heading_rad);
    errors.push_back({squared(off_m),
                      squared(off_rad),
                      path->variance,
                      {squared(edge.position_deviation_m), squared(edge.heading_deviation_rad)}});
  }
  if (errors.size() < min_closures) return std::nullopt;
  std::vector<double> normalised(errors.size());
  // The quartile falls with the factor, so that bisection finds it.
  double low = min_step_factor;
  double high = 1e3;
  while (high / low > 1.01) {
    const double middle = std::sqrt(low * high);
    for (std::size_t i = 0; i < errors.size(); ++i) normalised[i] = errors[i].normalised(middle);
    const auto quartile = normalised.begin() + static_cast<std::ptrdiff_t>(3 * errors.size() / 4);
    std::ranges::nth_element(normalised, quartile);
    const bool is_too_low = *quartile > quartile_of_three_squares;
    (is_too_low ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

PathVariances::PathVariances(std::span<const PoseEdge> edges, std::span<const double> weights,
                             std::span<const Pose2> poses, std::size_t node, double step_factor)
    : edges_(edges),
      weights_(weights),
      poses_(poses),
      node_(node),
      step_factor_(step_factor),
      edges_of_nodes_(2 * edges.size()),
      first_edge_(poses.size() + 1),
      variances_(poses.size()) {
  for (const PoseEdge& edge : edges) {
    ++first_edge_[edge.a];
    ++first_edge_[edge.b];
  }
  // Ends of the parts of nodes, which become their begins as the parts are filled from behind.
  std::partial_sum(first_edge_.begin(), first_edge_.end(), first_edge_.begin());
  for (std::size_t i = edges.size(); i-- > 0;) {
    edges_of_nodes_[--first_edge_[edges[i].b]] = i;
    edges_of_nodes_[--first_edge_[edges[i].a]] = i;
  }
  variances_[node] = {0.0, 0.0};
  next_.emplace(0.0, node);
}

PathVariance PathVariances::in_frame_of(std::size_t other) {
  // Nodes nearer than all that wait have their final variance.
  while (!next_.empty() && next_.top().first < variances_[other].position_m2) {
    const auto [reached_m2, here] = next_.top();
    next_.pop();
    if (reached_m2 == variances_[here].position_m2) reach_neighbours(here);
  }
  return variances_[other];
}

void PathVariances::reach_neighbours(std::size_t here) {
  for (std::size_t at = first_edge_[here]; at < first_edge_[here + 1]; ++at) {
    const std::size_t i = edges_of_nodes_[at];
    const PoseEdge& edge = edges_[i];
    const double factor = edge.doubtful ? 1.0 / std::max(weights_[i], 1e-6) : step_factor_;
    const std::size_t there = edge.a == here ? edge.b : edge.a;
    const double heading_rad2 = factor * squared(edge.heading_deviation_rad);
    const double arm_m = distance(poses_[there].position(), poses_[node_].position());
    const double position_m2 = variances_[here].position_m2 +
                               factor * squared(edge.position_deviation_m) +
                               heading_rad2 * squared(arm_m);
    if (position_m2 >= variances_[there].position_m2) continue;
    variances_[there] = {position_m2, variances_[here].heading_rad2 + heading_rad2};
    next_.emplace(position_m2, there);
  }
}

}  // namespace panonav
