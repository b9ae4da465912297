#include "panonav/navigation/direction_field.hpp"

#include <cmath>
#include <numbers>
#include <queue>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/navigation/internal/search_tree.hpp"

namespace panonav {

void visit_options(FieldOptions& options, OptionVisitor& visitor) {
  using T = FieldOptions;
  constexpr OptionTable table{
      option<&T::links_ahead>("number of edges ahead that are used to compute a direction", 1, 100),
      option<&T::max_bend_rad>(
          "bend of the path beyond which edges are not used to compute a direction", 0,
          std::numbers::pi),
  };
  table.visit(options, visitor);
}

std::vector<Guide> search_area(const NavigationGraph& graph, const SubAreas& areas,
                               std::size_t area, std::span<const SearchRoot> roots,
                               std::span<const std::uint8_t> blocked) {
  require(area < areas.nodes.size(), "area", static_cast<double>(area), "one of the areas");
  require(blocked.empty() || blocked.size() == graph.edges().size(), "size of blocked",
          static_cast<double>(blocked.size()), "0 or the number of edges");
  const std::vector<std::size_t>& nodes = areas.nodes[area];
  std::vector<Guide> guides(nodes.size());
  for (std::size_t index = 0; index < nodes.size(); ++index) guides[index].next = nodes[index];
  using Open = std::pair<double, std::size_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  for (const SearchRoot& root : roots) {
    require(root.node < graph.size() && areas.area_of[root.node] == area, "node of a root",
            static_cast<double>(root.node), "a node of the area");
    Guide& guide = guides[areas.index_in_area[root.node]];
    if (!(root.path_length < guide.path_length)) continue;
    guide = {root.path_length, root.next, root.edge, std::nullopt};
    open.emplace(root.path_length, root.node);
  }
  while (!open.empty()) {
    const auto [length, node] = open.top();
    open.pop();
    if (length > guides[areas.index_in_area[node]].path_length) continue;
    for (const NavigationGraph::Exit& exit : graph.exits(node)) {
      if (areas.area_of[exit.node] != area) continue;
      if (!blocked.empty() && blocked[exit.edge] != 0) continue;
      const double longer = length + graph.edges()[exit.edge].length;
      Guide& guide = guides[areas.index_in_area[exit.node]];
      if (longer < guide.path_length) {
        guide = {longer, node, exit.edge, std::nullopt};
        open.emplace(longer, exit.node);
      }
    }
  }
  return guides;
}

namespace {

// Returns the mean direction to the next nodes, up to the first bend larger than `max_bend_rad`.
std::optional<double> compute_direction(const NavigationGraph& graph, const SubAreas& areas,
                                        std::size_t node, const FieldOptions& options,
                                        std::span<const Guide> guides) {
  std::vector<double> directions;
  Pose2 node_from_here;
  std::optional<double> first;
  std::size_t here = node;
  for (int i = 0; i < options.links_ahead && areas.area_of[here] == areas.area_of[node]; ++i) {
    const Guide& guide = guides[areas.index_in_area[here]];
    if (!guide.is_reachable() || guide.next == here) break;
    const auto motion = graph.motion_from(here, guide.edge);
    if (!motion) break;
    const Pose2 node_from_next = node_from_here * *motion;
    const double x = node_from_next.x_m - node_from_here.x_m;
    const double y = node_from_next.y_m - node_from_here.y_m;
    if (x != 0.0 || y != 0.0) {
      const double along = std::atan2(y, x);
      if (first && std::abs(angle_difference(along, *first)) > options.max_bend_rad) break;
      if (!first) first = along;
      directions.push_back(std::atan2(node_from_next.y_m, node_from_next.x_m));
    }
    node_from_here = node_from_next;
    here = guide.next;
  }
  const auto mean = circular_mean(directions);
  return mean ? std::optional(mean->direction_rad) : std::nullopt;
}

}  // namespace

void set_directions(const NavigationGraph& graph, const SubAreas& areas, std::size_t area,
                    const FieldOptions& options, std::span<Guide> guides) {
  validate(options);
  require(area < areas.nodes.size(), "area", static_cast<double>(area), "one of the areas");
  require(guides.size() == areas.nodes[area].size(), "number of guides",
          static_cast<double>(guides.size()), "the number of nodes of the area");
  for (std::size_t index = 0; index < guides.size(); ++index) {
    guides[index].direction_rad =
        compute_direction(graph, areas, areas.nodes[area][index], options, guides);
  }
}

std::vector<Guide> direction_field(const NavigationGraph& graph, ViewId goal,
                                   const FieldOptions& options,
                                   std::span<const std::uint8_t> blocked) {
  const auto node = graph.node_of(goal);
  require(node.has_value(), "goal", static_cast<double>(goal.value), "a view of the graph");
  const SearchRoot root{*node, 0.0, *node, 0};
  const SubAreas areas = make_single_area(graph);
  std::vector<Guide> guides = search_area(graph, areas, 0, {&root, 1}, blocked);
  set_directions(graph, areas, 0, options, guides);
  return guides;
}

}  // namespace panonav
