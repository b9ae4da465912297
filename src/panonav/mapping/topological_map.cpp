#include "panonav/mapping/topological_map.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

namespace {

// Even a robot that stands still has so much error in a step: the noise of the pictures.
constexpr double min_position_deviation_m = 0.005;
constexpr double min_heading_deviation_rad = 0.003;
// Of the position that a closure tells: what the views leave unexplained shortens the way between
// them; for each unit of residual, in units of R.
constexpr double closure_deviation = 1.0;
constexpr double closure_position_deviation_m = 0.02;
constexpr double closure_turn_deviation = 0.05;
constexpr double closure_heading_deviation_rad = 0.01;
// Known steps by which the scale is judged: the latest, as R is another in every room.
constexpr std::size_t max_known_lengths = 15;
constexpr double refuted_weight = 0.1;
// Closures that are right within so many standard deviations do not pull.
constexpr double pulling_deviations = 3.0;

double length(const Pose2& step) {
  return std::hypot(step.x_m, step.y_m);
}

Pose2 with_length(const Pose2& step, double length_m) {
  const double now_m = length(step);
  if (!(now_m > 0.0)) return {length_m, 0.0, step.heading_rad};
  return {step.x_m * length_m / now_m, step.y_m * length_m / now_m, step.heading_rad};
}

}  // namespace

void validate(const TopologicalMap& map) {
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const MapNode& node = map.nodes[i];
    if (i > 0 && node.view <= map.nodes[i - 1].view) {
      throw ContractError("view of node " + std::to_string(i), static_cast<double>(node.view.value),
                          "larger than that of the node before");
    }
    if (!is_finite(node.pose)) {
      throw ContractError("node " + std::to_string(i), "not finite", "a finite pose");
    }
    if (node.component >= map.nodes.size()) {
      throw ContractError("connected component of node " + std::to_string(i),
                          static_cast<double>(node.component), "less than the number of nodes");
    }
  }
  for (std::size_t i = 0; i < map.edges.size(); ++i) {
    const MapEdge& edge = map.edges[i];
    const std::string name = "edge " + std::to_string(i);
    const auto is_node = [&](ViewId view) {
      return std::ranges::binary_search(map.nodes, view, {}, &MapNode::view);
    };
    if (edge.a == edge.b || !is_node(edge.a) || !is_node(edge.b)) {
      throw ContractError(name,
                          std::to_string(edge.a.value) + " to " + std::to_string(edge.b.value),
                          "views of two different nodes");
    }
    if (!is_finite(edge.a_from_b)) throw ContractError(name, "not finite", "a finite pose");
    require(edge.weight >= 0.0 && edge.weight <= 1.0, name + ": weight", edge.weight, "0 .. 1");
  }
}

void renumber_components(TopologicalMap& map) {
  std::map<std::size_t, std::size_t> numbers;
  for (const MapNode& node : map.nodes) numbers.emplace(node.component, 0);
  std::size_t next = 0;
  for (auto& [component, number] : numbers) number = next++;
  for (MapNode& node : map.nodes) node.component = numbers.at(node.component);
}

std::size_t number_of_components(const TopologicalMap& map) {
  std::set<std::size_t> components;
  for (const MapNode& node : map.nodes) components.insert(node.component);
  return components.size();
}

void visit_options(MappingOptions& options, OptionVisitor& visitor) {
  using T = MappingOptions;
  constexpr OptionTable table{
      option<&T::capture_difference>(
          "difference from the last node above which a view becomes a node; 0: every view", 0, 1),
      option<&T::close_loops>("look for places passed before"),
      option<&T::bridge_m>(
          "length of steps that neither views nor wheels show; 0: a new component begins", 0, 1e6),
      option<&T::wheel_lengths>("take the length of steps from the wheels"),
      option<&T::step_deviation>("deviation of positions read from views, for each metre", above(0),
                                 10),
      option<&T::turn_deviation>("deviation of headings read from views (rad), for each metre",
                                 above(0), 10),
      option<&T::wheel_deviation>(
          "deviation of positions where wheels tell the length, for each metre", above(0), 10),
  };
  table.visit(options, visitor);
}

TopologicalMapper::TopologicalMapper(const VisualMemory& memory, const MappingOptions& options,
                                     const VisualOdometryOptions& odometry,
                                     const LoopClosureOptions& closure,
                                     const PoseGraphOptions& graph)
    : memory_(&memory),
      options_(options),
      odometry_(odometry),
      graph_(graph),
      finder_(memory, closure, odometry) {
  validate(options);
  validate(graph);
}

bool TopologicalMapper::is_new(const OdometryView& view) const {
  const auto& last = odometry_.last();
  if (!last || options_.capture_difference == 0.0) return true;
  return image_difference(last->coefficients, view.coefficients) > options_.capture_difference;
}

void TopologicalMapper::add_step(const std::optional<VisualStep>& step,
                                 const std::optional<Pose2>& moved, MapUpdate& update) {
  const std::size_t here = nodes_.size() - 1;
  if (!step && !moved && options_.bridge_m > 0.0) {
    constexpr double any_heading_rad = 1.0;
    edges_.push_back(
        {here - 1, here, {options_.bridge_m, 0.0, 0.0}, options_.bridge_m, any_heading_rad});
    weights_.push_back(1.0);
    poses_.push_back(poses_.back() * edges_.back().a_from_b);
    components_.push_back(components_.back());
    nodes_[here].way_m = nodes_[here - 1].way_m + options_.bridge_m;
    return;
  }
  if (!step && !moved) {
    // A frame of its own; the way goes on, so that its views are no candidates for each other.
    update.new_component = true;
    components_.push_back(components_.back() + 1);
    poses_.emplace_back();
    nodes_[here].way_m = nodes_[here - 1].way_m;
    return;
  }
  Pose2 motion = step ? step->before_from_after : *moved;
  const bool wheels = moved && (options_.wheel_lengths || !step);
  if (step && wheels) motion = with_length(motion, length(*moved));
  const double length_m = length(motion);
  const double position = wheels ? options_.wheel_deviation : options_.step_deviation;
  edges_.push_back({here - 1, here, motion, position * length_m + min_position_deviation_m,
                    options_.turn_deviation * length_m + min_heading_deviation_rad});
  weights_.push_back(1.0);
  poses_.push_back(poses_.back() * motion);
  components_.push_back(components_.back());
  nodes_[here].way_m = nodes_[here - 1].way_m + length_m;
}

MapUpdate TopologicalMapper::add(ViewId view, OdometryView seen,
                                 const std::optional<Pose2>& moved) {
  if (!memory_->contains(view) || (!nodes_.empty() && view <= nodes_.back().view)) {
    throw ContractError("view", static_cast<double>(view.value),
                        "a view of the memory, later than those of the map");
  }
  if (moved) {
    require(is_finite(*moved), "step of the wheels", length(*moved), "finite");
  }
  MapUpdate update;
  update.step = odometry_.add(std::move(seen));
  nodes_.push_back({view, 0.0});
  if (nodes_.size() == 1) {
    poses_.emplace_back();
    components_.push_back(0);
    update.new_component = true;
  } else {
    if (moved && update.step && options_.wheel_lengths) {
      known_lengths_.push_back({update.step->length_in_views, length(*moved)});
      if (known_lengths_.size() > max_known_lengths) known_lengths_.erase(known_lengths_.begin());
    }
    add_step(update.step, moved, update);
  }
  if (options_.close_loops) close_loops(update);
  return update;
}

double TopologicalMapper::scale_m() const {
  return length_scale_m(known_lengths_).value_or(odometry_.scale_m());
}

void TopologicalMapper::close_loops(MapUpdate& update) {
  const double scale_m = this->scale_m();
  update.closures = finder_.find(nodes_, poses_, *odometry_.last(), scale_m);
  for (const LoopClosure& closure : update.closures) {
    join_components(closure);
    const double length_m = length(closure.earlier_from_later);
    edges_.push_back({closure.earlier, closure.later, closure.earlier_from_later,
                      closure_deviation * closure.residual * scale_m + closure_position_deviation_m,
                      closure_turn_deviation * length_m + closure_heading_deviation_rad, true});
    weights_.push_back(1.0);
  }
  if (update.closures.empty()) return;
  changed_ = true;
  optimise_latest();
  for (std::size_t i = edges_.size() - update.closures.size(); i < edges_.size(); ++i) {
    if (edge_tension(edges_[i], poses_) > pulling_deviations) pulled_ = true;
  }
  if (pulled_ && size() >= optimised_size_ + std::max<std::size_t>(1, optimised_size_ / 100)) {
    optimise();
    update.optimised = true;
  }
}

// Nodes since the closure before move; edges at the end of the list are theirs.
void TopologicalMapper::optimise_latest() {
  const std::size_t first = anchored_ + 1;
  anchored_ = size() - 1;
  if (first >= size()) return;
  std::map<std::size_t, std::size_t> number;  // of nodes in the small graph
  std::vector<Pose2> poses;
  std::vector<std::uint8_t> fixed;
  const auto number_of = [&](std::size_t node) {
    const auto [found, added] = number.try_emplace(node, poses.size());
    if (added) {
      poses.push_back(poses_[node]);
      fixed.push_back(node < first ? 1 : 0);
    }
    return found->second;
  };
  std::vector<PoseEdge> edges;
  for (std::size_t i = edges_.size(); i-- > 0 && std::max(edges_[i].a, edges_[i].b) >= first;) {
    PoseEdge edge = edges_[i];
    edge.a = number_of(edge.a);
    edge.b = number_of(edge.b);
    edges.push_back(edge);
  }
  static_cast<void>(optimise_pose_graph(poses, edges, graph_, fixed));
  for (const auto& [node, at] : number) poses_[node] = poses[at];
}

void TopologicalMapper::join_components(const LoopClosure& closure) {
  const std::size_t kept = components_[closure.earlier];
  const std::size_t joined = components_[closure.later];
  if (kept == joined) return;
  const Pose2 kept_from_joined =
      poses_[closure.earlier] * closure.earlier_from_later * inverse(poses_[closure.later]);
  for (std::size_t i = 0; i < size(); ++i) {
    if (components_[i] != joined) continue;
    components_[i] = kept;
    poses_[i] = kept_from_joined * poses_[i];
  }
}

void TopologicalMapper::optimise() {
  weights_ = optimise_pose_graph(poses_, edges_, graph_).edge_weights;
  // What the rest of the map refutes is no closure.
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    if (edges_[i].doubtful && weights_[i] < refuted_weight) continue;
    edges_[kept] = edges_[i];
    weights_[kept++] = weights_[i];
  }
  edges_.resize(kept);
  weights_.resize(kept);
  optimised_size_ = size();
  changed_ = false;
  pulled_ = false;
}

void TopologicalMapper::finish() {
  if (changed_) optimise();
}

TopologicalMap TopologicalMapper::map() const {
  TopologicalMap map;
  std::map<std::size_t, std::size_t> number;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto component = number.try_emplace(components_[i], number.size()).first->second;
    map.nodes.push_back({nodes_[i].view, poses_[i], component});
  }
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const PoseEdge& edge = edges_[i];
    map.edges.push_back({nodes_[edge.a].view, nodes_[edge.b].view, edge.a_from_b,
                         edge.doubtful ? LinkKind::closure : LinkKind::sequence, weights_[i]});
  }
  return map;
}

}  // namespace panonav
