#include "panonav/navigation/area_planner.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/navigation/internal/search_tree.hpp"

namespace panonav {

namespace {

/// Path length where there is no path.
constexpr double unreachable_length = std::numeric_limits<double>::infinity();

}  // namespace

void visit_options(PlannerOptions& options, OptionVisitor& visitor) {
  using T = PlannerOptions;
  constexpr OptionTable table{
      options_of<&T::field>(),
      options_of<&T::areas>(),
      option<&T::gates_per_border>("number of gates that are used between two areas; a gate is a "
                                   "view at the border of the areas; 0: all",
                                   0, 1e6),
  };
  table.visit(options, visitor);
}

AreaPlanner::AreaPlanner(NavigationGraph graph, const PlannerOptions& options)
    : AreaPlanner(graph, divide_into_areas(graph, options.areas), options) {}

AreaPlanner::AreaPlanner(NavigationGraph graph, SubAreas areas, const PlannerOptions& options)
    : graph_(std::move(graph)),
      areas_(std::move(areas)),
      options_(options),
      blocked_(graph_.edges().size(), 0),
      gate_ends_(areas_.nodes.size()) {
  validate(options_);
  require(areas_.area_of.size() == graph_.size() && areas_.index_in_area.size() == graph_.size(),
          "views in areas", static_cast<double>(areas_.area_of.size()), "those of the graph");
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> known;
  for (const std::size_t gate : areas_.gates) {
    const NavigationGraph::Edge& edge = graph_.edges()[gate];
    const auto [low, high] = std::minmax(areas_.area_of[*graph_.node_of(edge.a)],
                                         areas_.area_of[*graph_.node_of(edge.b)]);
    const auto [found, is_new] = known.try_emplace({low, high}, borders_.size());
    if (is_new) {
      gate_ends_[low].borders.push_back(borders_.size());
      gate_ends_[high].borders.push_back(borders_.size());
      borders_.push_back({low, high, {}, {}});
    }
    borders_[found->second].edges.push_back(gate);
  }
  for (Border& border : borders_) choose_gates(border);
  for (std::size_t area = 0; area < gate_ends_.size(); ++area) compute_gate_paths(area);
}

std::size_t AreaPlanner::used_gate_count() const noexcept {
  std::size_t count = 0;
  for (const Border& border : borders_) count += border.gates.size();
  return count;
}

std::pair<std::size_t, std::size_t> AreaPlanner::ends_of(std::size_t edge, std::size_t area) const {
  const std::size_t a = *graph_.node_of(graph_.edges()[edge].a);
  const std::size_t b = *graph_.node_of(graph_.edges()[edge].b);
  return areas_.area_of[a] == area ? std::pair(a, b) : std::pair(b, a);
}

std::vector<Guide> AreaPlanner::search_from(std::size_t area, std::size_t node) const {
  const SearchRoot root{node, 0.0, node, 0};
  return search_area(graph_, areas_, area, {&root, 1}, blocked_);
}

// Returns the node to which the exit leads, as an index among the gate ends of its area; nullopt if
// the exit stays in `area`, is blocked or leads to no gate end.
std::optional<std::size_t> AreaPlanner::find_gate_end_beyond(
    std::size_t area, const NavigationGraph::Exit& exit) const {
  const std::size_t beyond = areas_.area_of[exit.node];
  if (beyond == area || blocked_[exit.edge] != 0) return std::nullopt;
  const auto& nodes = gate_ends_[beyond].nodes;
  const auto found = std::ranges::lower_bound(nodes, exit.node);
  if (found == nodes.end() || *found != exit.node) return std::nullopt;
  return static_cast<std::size_t>(found - nodes.begin());
}

// Chooses gates one after another; each is the one farthest from those already chosen.
void AreaPlanner::choose_gates(Border& border) const {
  std::vector<std::size_t> open;
  for (const std::size_t gate : border.edges) {
    if (blocked_[gate] == 0) open.push_back(gate);
  }
  const auto max_gates = static_cast<std::size_t>(options_.gates_per_border);
  if (max_gates == 0 || open.size() <= max_gates) {
    border.gates = std::move(open);
    return;
  }
  border.gates.clear();
  std::vector<double> nearest(open.size(), unreachable_length);
  std::size_t next = 0;
  while (border.gates.size() < max_gates) {
    border.gates.push_back(open[next]);
    const auto guides = search_from(border.low, ends_of(open[next], border.low).first);
    nearest[next] = -1.0;  // chosen
    for (std::size_t i = 0; i < open.size(); ++i) {
      const std::size_t end = ends_of(open[i], border.low).first;
      nearest[i] = std::min(nearest[i], guides[areas_.index_in_area[end]].path_length);
    }
    next = static_cast<std::size_t>(std::ranges::max_element(nearest) - nearest.begin());
  }
  std::ranges::sort(border.gates);
}

void AreaPlanner::compute_gate_paths(std::size_t area) {
  GateEnds& ends = gate_ends_[area];
  std::set<std::size_t> nodes;
  for (const std::size_t border : ends.borders) {
    for (const std::size_t gate : borders_[border].gates) nodes.insert(ends_of(gate, area).first);
  }
  ends.nodes.assign(nodes.begin(), nodes.end());
  ends.lengths_to_goal.assign(nodes.size(), unreachable_length);
  ends.path_lengths.clear();
  for (const std::size_t from : ends.nodes) {
    const auto guides = search_from(area, from);
    for (const std::size_t to : ends.nodes)
      ends.path_lengths.push_back(guides[areas_.index_in_area[to]].path_length);
  }
}

void AreaPlanner::set_goal(ViewId goal) {
  goal_ = graph_.node_of(goal);
  require(goal_.has_value(), "goal", static_cast<double>(goal.value), "a view of the graph");
  plan_over_areas();
}

std::optional<ViewId> AreaPlanner::goal() const {
  return goal_ ? std::optional(graph_.view(*goal_)) : std::nullopt;
}

// Computes the path lengths from the gate ends of all areas to the goal [Dijkstra].
void AreaPlanner::plan_over_areas() {
  for (GateEnds& ends : gate_ends_) std::ranges::fill(ends.lengths_to_goal, unreachable_length);
  if (!goal_) return;
  struct Open {
    double length;
    std::size_t area, end;
    auto operator<=>(const Open&) const = default;
  };
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  const auto relax = [&](double length, std::size_t area, std::size_t end) {
    double& known = gate_ends_[area].lengths_to_goal[end];
    if (!(length < known)) return;
    known = length;
    open.push({length, area, end});
  };
  const std::size_t goal_area = areas_.area_of[*goal_];
  const auto guides = search_from(goal_area, *goal_);
  for (std::size_t end = 0; end < gate_ends_[goal_area].nodes.size(); ++end) {
    relax(guides[areas_.index_in_area[gate_ends_[goal_area].nodes[end]]].path_length, goal_area,
          end);
  }
  while (!open.empty()) {
    const Open at = open.top();
    open.pop();
    const GateEnds& ends = gate_ends_[at.area];
    if (at.length > ends.lengths_to_goal[at.end]) continue;
    const std::size_t count = ends.nodes.size();
    for (std::size_t to = 0; to < count; ++to) {
      relax(at.length + ends.path_lengths[at.end * count + to], at.area, to);
    }
    for (const NavigationGraph::Exit& exit : graph_.exits(ends.nodes[at.end])) {
      if (const auto end = find_gate_end_beyond(at.area, exit)) {
        relax(at.length + graph_.edges()[exit.edge].length, areas_.area_of[exit.node], *end);
      }
    }
  }
}

void AreaPlanner::block(std::span<const std::size_t> edges) {
  std::set<std::size_t> changed;
  for (const std::size_t edge : edges) {
    require(edge < blocked_.size(), "edge", static_cast<double>(edge), "an edge of the graph");
    blocked_[edge] = 1;
    for (const ViewId view : {graph_.edges()[edge].a, graph_.edges()[edge].b}) {
      changed.insert(areas_.area_of[*graph_.node_of(view)]);
    }
  }
  // Another open gate of the border replaces a blocked one.
  for (Border& border : borders_) {
    const bool lost =
        std::ranges::any_of(border.gates, [&](std::size_t gate) { return blocked_[gate] != 0; });
    if (lost) choose_gates(border);
  }
  for (const std::size_t area : changed) compute_gate_paths(area);
  plan_over_areas();
}

void AreaPlanner::unblock_all() {
  std::set<std::size_t> changed;
  for (std::size_t edge = 0; edge < blocked_.size(); ++edge) {
    if (std::exchange(blocked_[edge], std::uint8_t{0}) == 0) continue;
    for (const ViewId view : {graph_.edges()[edge].a, graph_.edges()[edge].b}) {
      changed.insert(areas_.area_of[*graph_.node_of(view)]);
    }
  }
  for (Border& border : borders_) {
    if (changed.contains(border.low) && changed.contains(border.high)) choose_gates(border);
  }
  for (const std::size_t area : changed) compute_gate_paths(area);
  plan_over_areas();
}

std::size_t AreaPlanner::blocked_edge_count() const noexcept {
  return static_cast<std::size_t>(std::ranges::count(blocked_, std::uint8_t{1}));
}

std::vector<Guide> AreaPlanner::field(std::size_t area) const {
  require(area < gate_ends_.size(), "area", static_cast<double>(area), "one of the areas");
  std::vector<SearchRoot> roots;
  if (goal_ && areas_.area_of[*goal_] == area) roots.push_back({*goal_, 0.0, *goal_, 0});
  for (const std::size_t node : gate_ends_[area].nodes) {
    for (const NavigationGraph::Exit& exit : graph_.exits(node)) {
      const auto end = find_gate_end_beyond(area, exit);
      if (!end) continue;
      const double length = gate_ends_[areas_.area_of[exit.node]].lengths_to_goal[*end] +
                            graph_.edges()[exit.edge].length;
      if (length < unreachable_length) roots.push_back({node, length, exit.node, exit.edge});
    }
  }
  std::vector<Guide> guides = search_area(graph_, areas_, area, roots, blocked_);
  set_directions(graph_, areas_, area, options_.field, guides);
  return guides;
}

std::vector<std::size_t> AreaPlanner::plan_path(std::size_t start) const {
  require(start < graph_.size(), "start", static_cast<double>(start), "a node of the graph");
  std::map<std::size_t, std::vector<Guide>> fields;
  std::vector<std::size_t> path;
  for (std::size_t node = start;;) {
    const std::size_t area = areas_.area_of[node];
    const auto [found, is_new] = fields.try_emplace(area);
    if (is_new) found->second = field(area);
    const Guide& guide = found->second[areas_.index_in_area[node]];
    if (!guide.is_reachable()) return {};
    path.push_back(node);
    if (guide.next == node) return path;
    node = guide.next;
  }
}

}  // namespace panonav
