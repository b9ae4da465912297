#include "panonav/mapping/internal/lattice_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>

#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/internal/lattice_graph.hpp"
#include "panonav/mapping/internal/lattice_springs.hpp"
#include "panonav/mapping/internal/multidimensional_scaling.hpp"

namespace panonav {

namespace {

std::vector<std::vector<std::size_t>> members_of(const std::vector<std::size_t>& components) {
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t node = 0; node < components.size(); ++node) {
    if (components[node] >= members.size()) members.resize(components[node] + 1);
    members[components[node]].push_back(node);
  }
  return members;
}

/// Sets headings along a spanning tree of the springs whose views disagree least. The first view of
/// each component has heading 0.
void set_headings(const LatticeGraph& graph, std::span<const Lattice::Spring> springs,
                  std::vector<Pose2>& poses) {
  using Open = std::tuple<double, std::size_t, std::size_t>;  // disagreement, spring, node
  std::vector<unsigned char> done(poses.size());
  for (std::size_t first = 0; first < poses.size(); ++first) {
    if (done[first] != 0) continue;
    std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
    const auto reach = [&](std::size_t node, double heading_rad) {
      poses[node].heading_rad = wrap_angle(heading_rad);
      done[node] = 1;
      for (const auto& neighbour : graph.neighbours(node)) {
        const auto& phases = springs[neighbour.edge].phases;
        if (!phases || done[neighbour.node] != 0) continue;
        open.emplace(phases->turn_disagreement_rad, neighbour.edge, neighbour.node);
      }
    };
    reach(first, 0.0);
    while (!open.empty()) {
      const auto [unused, edge, node] = open.top();
      open.pop();
      if (done[node] != 0) continue;
      const Lattice::Spring& spring = springs[edge];
      if (node == spring.b) {
        reach(node, poses[spring.a].heading_rad + spring.phases->turn_rad);
      } else {
        reach(node, poses[spring.b].heading_rad - spring.phases->turn_rad);
      }
    }
  }
}

/// Chooses landmarks, each the farthest from those before, and appends their distances to all
/// nodes.
std::vector<std::size_t> choose_landmarks(const LatticeGraph& graph, std::size_t count,
                                          std::vector<double>& distances) {
  std::vector<std::size_t> landmarks;
  std::vector<double> nearest(graph.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  while (landmarks.size() < std::min(count, graph.size())) {
    landmarks.push_back(next);
    const auto lengths = graph.shortest_path_lengths(next);
    distances.insert(distances.end(), lengths.begin(), lengths.end());
    for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] = std::min(nearest[i], lengths[i]);
    for (const std::size_t landmark : landmarks) nearest[landmark] = -1.0;
    next = static_cast<std::size_t>(std::ranges::max_element(nearest) - nearest.begin());
  }
  return landmarks;
}

/// Rotates, and mirrors if that fits better, the positions of one component to the directions of
/// its springs. False when no spring has a direction.
bool align_to_directions(const std::vector<std::size_t>& members,
                         const std::vector<std::size_t>& components,
                         std::span<const Lattice::Spring> springs, std::vector<Pose2>& poses) {
  std::vector<Point2> layout;
  std::vector<Point2> measured;
  const std::size_t component = components[members.front()];
  for (const Lattice::Spring& spring : springs) {
    if (components[spring.a] != component || !spring.phases || !spring.phases->has_direction)
      continue;
    const Pose2& a = poses[spring.a];
    const Pose2& b = poses[spring.b];
    const double length = distance(a.position(), b.position());
    if (!(length > 0.0)) continue;
    const double world_rad = a.heading_rad + spring.phases->direction_a_rad;
    // Each direction is added with both signs, so that both sets are centred on 0.
    for (const double sign : {1.0, -1.0}) {
      layout.push_back({sign * (b.x_m - a.x_m) / length, sign * (b.y_m - a.y_m) / length});
      measured.push_back({sign * std::cos(world_rad), sign * std::sin(world_rad)});
    }
  }
  if (measured.empty()) return false;
  const Alignment turned = align(layout, measured, {.allow_reflection = true});
  for (const std::size_t node : members) {
    const Point2 p = turned.apply(poses[node].position());
    poses[node].x_m = p.x_m;
    poses[node].y_m = p.y_m;
  }
  return true;
}

}  // namespace

LatticeLayout lay_out_by_springs(std::size_t nodes, std::span<const Lattice::Spring> springs,
                                 int landmarks) {
  std::vector<GraphEdge> edges;
  for (const auto& spring : springs) edges.push_back({spring.a, spring.b, spring.length});
  const LatticeGraph graph(nodes, edges);
  LatticeLayout layout{.poses = std::vector<Pose2>(nodes), .components = graph.components()};
  set_headings(graph, springs, layout.poses);
  std::vector<std::size_t> local(nodes);
  for (const auto& members : members_of(layout.components)) {
    for (std::size_t i = 0; i < members.size(); ++i) local[members[i]] = i;
    std::vector<GraphEdge> own;
    for (const GraphEdge& edge : edges) {
      if (layout.components[edge.a] != layout.components[members.front()]) continue;
      own.push_back({local[edge.a], local[edge.b], edge.length});
    }
    std::vector<double> distances;
    const auto chosen = choose_landmarks(LatticeGraph(members.size(), own),
                                         static_cast<std::size_t>(landmarks), distances);
    const auto points = multidimensional_scaling(chosen, members.size(), distances);
    for (std::size_t i = 0; i < members.size(); ++i) {
      layout.poses[members[i]].x_m = points[i].x_m;
      layout.poses[members[i]].y_m = points[i].y_m;
    }
    layout.handedness_known.push_back(
        align_to_directions(members, layout.components, springs, layout.poses) ? 1 : 0);
  }
  return layout;
}

bool is_compatible(const PhaseReading& phases, const CoarseMotion& motion) {
  constexpr double max_deviations = 3.0;  // which normal errors exceed once in 370 times
  const double turn = std::abs(angle_difference(phases.turn_rad, motion.step.heading_rad));
  if (turn > max_deviations * motion.turn_deviation_rad) return false;
  const double travel = std::hypot(motion.step.x_m, motion.step.y_m);
  if (!phases.has_direction || travel <= max_deviations * motion.distance_deviation_m) return true;
  const double direction = std::abs(
      angle_difference(phases.direction_a_rad, std::atan2(motion.step.y_m, motion.step.x_m)));
  return direction <= max_deviations * motion.direction_deviation_rad;
}

LatticeLayout lay_out_by_motion(std::size_t nodes, std::span<const NodeMotion> motions,
                                std::span<const Lattice::Spring> springs) {
  std::map<std::pair<std::size_t, std::size_t>, const Lattice::Spring*> spring_between;
  for (const Lattice::Spring& spring : springs) {
    if (spring.phases) spring_between[{spring.a, spring.b}] = &spring;
  }
  std::vector<GraphEdge> edges;
  for (const auto& motion : motions) edges.push_back({motion.a, motion.b, 1.0});
  const LatticeGraph graph(nodes, edges);
  LatticeLayout layout{.poses = std::vector<Pose2>(nodes), .components = graph.components()};
  std::vector<unsigned char> done(nodes);
  layout.handedness_known.assign(members_of(layout.components).size(), 0);
  for (std::size_t first = 0; first < nodes; ++first) {
    if (done[first] != 0) continue;
    // Breadth first, so that errors of as few steps as possible add up.
    std::queue<std::size_t> open;
    open.push(first);
    done[first] = 1;
    while (!open.empty()) {
      const std::size_t from = open.front();
      open.pop();
      for (const auto& neighbour : graph.neighbours(from)) {
        if (done[neighbour.node] != 0) continue;
        const NodeMotion& moved = motions[neighbour.edge];
        Pose2 step = moved.motion.step;  // in the frame of the motion's first node
        const auto found = spring_between.find(std::minmax(moved.a, moved.b));
        if (found != spring_between.end()) {
          const Lattice::Spring& spring = *found->second;
          const PhaseReading phases = read_phases_from(moved.a, spring);
          if (is_compatible(phases, moved.motion)) {
            step.heading_rad = phases.turn_rad;
            if (phases.has_direction) {
              const double travel = std::hypot(step.x_m, step.y_m);
              step.x_m = travel * std::cos(phases.direction_a_rad);
              step.y_m = travel * std::sin(phases.direction_a_rad);
            }
          }
        }
        layout.poses[neighbour.node] =
            layout.poses[from] * (from == moved.a ? step : inverse(step));
        done[neighbour.node] = 1;
        layout.handedness_known[layout.components[from]] = 1;
        open.push(neighbour.node);
      }
    }
  }
  return layout;
}

}  // namespace panonav
