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

constexpr double unreachable = std::numeric_limits<double>::infinity();

}  // namespace

void visit_options(PlannerOptions& options, OptionVisitor& visitor) {
  using T = PlannerOptions;
  constexpr OptionTable table{
      options_of<&T::field>(),
      options_of<&T::areas>(),
      option<&T::gates_per_border>("gates that count between two areas, 0 for all", 0, 1e6),
  };
  table.visit(options, visitor);
}

AreaPlanner::AreaPlanner(NavigationGraph graph, const PlannerOptions& options)
    : AreaPlanner(graph, divide(graph, options.areas), options) {}

AreaPlanner::AreaPlanner(NavigationGraph graph, SubAreas areas, const PlannerOptions& options)
    : graph_(std::move(graph)),
      areas_(std::move(areas)),
      options_(options),
      closed_(graph_.edges().size(), 0),
      ends_(areas_.nodes.size()) {
  validate(options_);
  require(areas_.area_of.size() == graph_.size() && areas_.place_of.size() == graph_.size(),
          "views in areas", static_cast<double>(areas_.area_of.size()), "those of the graph");
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> known;
  for (const std::size_t gate : areas_.gates) {
    const NavigationGraph::Edge& edge = graph_.edges()[gate];
    const auto [low, high] = std::minmax(areas_.area_of[*graph_.node_of(edge.a)],
                                         areas_.area_of[*graph_.node_of(edge.b)]);
    const auto [found, is_new] = known.try_emplace({low, high}, borders_.size());
    if (is_new) {
      ends_[low].borders.push_back(borders_.size());
      ends_[high].borders.push_back(borders_.size());
      borders_.push_back({low, high, {}, {}});
    }
    borders_[found->second].edges.push_back(gate);
  }
  for (Border& border : borders_) choose_gates(border);
  for (std::size_t area = 0; area < ends_.size(); ++area) find_ways(area);
}

std::size_t AreaPlanner::gates() const noexcept {
  std::size_t count = 0;
  for (const Border& border : borders_) count += border.chosen.size();
  return count;
}

std::pair<std::size_t, std::size_t> AreaPlanner::ends_of(std::size_t edge, std::size_t area) const {
  const std::size_t a = *graph_.node_of(graph_.edges()[edge].a);
  const std::size_t b = *graph_.node_of(graph_.edges()[edge].b);
  return areas_.area_of[a] == area ? std::pair(a, b) : std::pair(b, a);
}

std::vector<Guide> AreaPlanner::tree_from(std::size_t area, std::size_t node) const {
  const SearchRoot root{node, 0.0, node, 0};
  return search_tree(graph_, areas_, area, {&root, 1}, closed_);
}

// The place among the ends of the next area to which an open gate leads, if it ends there.
std::optional<std::size_t> AreaPlanner::end_beyond(std::size_t area,
                                                   const NavigationGraph::Exit& exit) const {
  const std::size_t beyond = areas_.area_of[exit.node];
  if (beyond == area || closed_[exit.edge] != 0) return std::nullopt;
  const auto& nodes = ends_[beyond].nodes;
  const auto found = std::ranges::lower_bound(nodes, exit.node);
  if (found == nodes.end() || *found != exit.node) return std::nullopt;
  return static_cast<std::size_t>(found - nodes.begin());
}

// The gates that lie farthest from those chosen before, one after the other.
void AreaPlanner::choose_gates(Border& border) const {
  std::vector<std::size_t> open;
  for (const std::size_t gate : border.edges) {
    if (closed_[gate] == 0) open.push_back(gate);
  }
  const auto most = static_cast<std::size_t>(options_.gates_per_border);
  if (most == 0 || open.size() <= most) {
    border.chosen = std::move(open);
    return;
  }
  border.chosen.clear();
  std::vector<double> nearest(open.size(), unreachable);
  std::size_t next = 0;
  while (border.chosen.size() < most) {
    border.chosen.push_back(open[next]);
    const auto guides = tree_from(border.low, ends_of(open[next], border.low).first);
    nearest[next] = -1.0;  // not once more
    for (std::size_t i = 0; i < open.size(); ++i) {
      const std::size_t end = ends_of(open[i], border.low).first;
      nearest[i] = std::min(nearest[i], guides[areas_.place_of[end]].way);
    }
    next = static_cast<std::size_t>(std::ranges::max_element(nearest) - nearest.begin());
  }
  std::ranges::sort(border.chosen);
}

void AreaPlanner::find_ways(std::size_t area) {
  Ends& ends = ends_[area];
  std::set<std::size_t> nodes;
  for (const std::size_t border : ends.borders) {
    for (const std::size_t gate : borders_[border].chosen) nodes.insert(ends_of(gate, area).first);
  }
  ends.nodes.assign(nodes.begin(), nodes.end());
  ends.to_goal.assign(nodes.size(), unreachable);
  ends.ways.clear();
  for (const std::size_t from : ends.nodes) {
    const auto guides = tree_from(area, from);
    for (const std::size_t to : ends.nodes) ends.ways.push_back(guides[areas_.place_of[to]].way);
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

void AreaPlanner::plan_over_areas() {
  for (Ends& ends : ends_) std::ranges::fill(ends.to_goal, unreachable);
  if (!goal_) return;
  struct Open {
    double way;
    std::size_t area, end;
    auto operator<=>(const Open&) const = default;
  };
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  const auto offer = [&](double way, std::size_t area, std::size_t end) {
    double& known = ends_[area].to_goal[end];
    if (!(way < known)) return;
    known = way;
    open.push({way, area, end});
  };
  const std::size_t goal_area = areas_.area_of[*goal_];
  const auto guides = tree_from(goal_area, *goal_);
  for (std::size_t end = 0; end < ends_[goal_area].nodes.size(); ++end) {
    offer(guides[areas_.place_of[ends_[goal_area].nodes[end]]].way, goal_area, end);
  }
  while (!open.empty()) {
    const Open at = open.top();
    open.pop();
    const Ends& ends = ends_[at.area];
    if (at.way > ends.to_goal[at.end]) continue;
    const std::size_t count = ends.nodes.size();
    for (std::size_t to = 0; to < count; ++to) {
      offer(at.way + ends.ways[at.end * count + to], at.area, to);
    }
    for (const NavigationGraph::Exit& exit : graph_.exits(ends.nodes[at.end])) {
      const std::size_t beyond = areas_.area_of[exit.node];
      const auto end = end_beyond(at.area, exit);
      if (end) offer(at.way + graph_.edges()[exit.edge].length, beyond, *end);
    }
  }
}

void AreaPlanner::close(std::span<const std::size_t> edges) {
  std::set<std::size_t> changed;
  for (const std::size_t edge : edges) {
    require(edge < closed_.size(), "edge", static_cast<double>(edge), "an edge of the graph");
    closed_[edge] = 1;
    changed.insert(areas_.area_of[*graph_.node_of(graph_.edges()[edge].a)]);
    changed.insert(areas_.area_of[*graph_.node_of(graph_.edges()[edge].b)]);
  }
  // A closed gate gives its place to another one of the border.
  for (Border& border : borders_) {
    const bool lost =
        std::ranges::any_of(border.chosen, [&](std::size_t gate) { return closed_[gate] != 0; });
    if (lost) choose_gates(border);
  }
  for (const std::size_t area : changed) find_ways(area);
  plan_over_areas();
}

void AreaPlanner::unblock_all() {
  std::set<std::size_t> changed;
  for (std::size_t edge = 0; edge < closed_.size(); ++edge) {
    if (closed_[edge] == 0) continue;
    closed_[edge] = 0;
    changed.insert(areas_.area_of[*graph_.node_of(graph_.edges()[edge].a)]);
    changed.insert(areas_.area_of[*graph_.node_of(graph_.edges()[edge].b)]);
  }
  for (Border& border : borders_) {
    if (changed.contains(border.low) && changed.contains(border.high)) choose_gates(border);
  }
  for (const std::size_t area : changed) find_ways(area);
  plan_over_areas();
}

std::size_t AreaPlanner::closed() const noexcept {
  return static_cast<std::size_t>(std::ranges::count(closed_, std::uint8_t{1}));
}

std::vector<Guide> AreaPlanner::field(std::size_t area) const {
  require(area < ends_.size(), "area", static_cast<double>(area), "one of the areas");
  std::vector<SearchRoot> roots;
  if (goal_ && areas_.area_of[*goal_] == area) roots.push_back({*goal_, 0.0, *goal_, 0});
  for (const std::size_t node : ends_[area].nodes) {
    for (const NavigationGraph::Exit& exit : graph_.exits(node)) {
      const auto end = end_beyond(area, exit);
      if (!end) continue;
      const double way =
          ends_[areas_.area_of[exit.node]].to_goal[*end] + graph_.edges()[exit.edge].length;
      if (way < unreachable) roots.push_back({node, way, exit.node, exit.edge});
    }
  }
  std::vector<Guide> guides = search_tree(graph_, areas_, area, roots, closed_);
  set_directions(graph_, areas_, area, options_.field, guides);
  return guides;
}

std::vector<std::size_t> AreaPlanner::plan_path(std::size_t start) const {
  require(start < graph_.size(), "start", static_cast<double>(start), "a node of the graph");
  std::map<std::size_t, std::vector<Guide>> fields;
  std::vector<std::size_t> way;
  for (std::size_t node = start;;) {
    const std::size_t area = areas_.area_of[node];
    const auto [found, is_new] = fields.try_emplace(area);
    if (is_new) found->second = field(area);
    const Guide& guide = found->second[areas_.place_of[node]];
    if (!guide.reachable()) return {};
    way.push_back(node);
    if (guide.next == node) return way;
    node = guide.next;
  }
}

}  // namespace panonav
