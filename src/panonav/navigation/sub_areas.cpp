#include "panonav/navigation/sub_areas.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

namespace panonav {

void visit_options(SubAreaOptions& options, OptionVisitor& visitor) {
  using T = SubAreaOptions;
  constexpr OptionTable table{
      option<&T::views_per_area>("intended number of views in an area", 2, 1e6),
      option<&T::iterations>("number of relaxation steps for each cut between areas", 0, 1e5),
  };
  table.visit(options, visitor);
}

namespace {

constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
/// Smallest share of the views on one side of a cut, so that areas become similar in size.
constexpr double min_side_share = 1.0 / 3.0;

/// A subgraph: some nodes of a graph, numbered from 0, and the edges between them.
struct Component {
  std::vector<std::size_t> nodes;  // ascending
  std::vector<std::size_t> begins, neighbours;

  [[nodiscard]] std::size_t size() const { return nodes.size(); }
  [[nodiscard]] std::span<const std::size_t> neighbours_of(std::size_t i) const {
    return std::span(neighbours).subspan(begins[i], begins[i + 1] - begins[i]);
  }
};

Component make_component(const NavigationGraph& graph, std::vector<std::size_t> nodes,
                         std::vector<std::size_t>& number) {
  Component component;
  component.nodes = std::move(nodes);
  for (std::size_t i = 0; i < component.size(); ++i) number[component.nodes[i]] = i;
  component.begins.push_back(0);
  for (const std::size_t node : component.nodes) {
    for (const NavigationGraph::Exit& exit : graph.exits(node)) {
      if (number[exit.node] != none) component.neighbours.push_back(number[exit.node]);
    }
    component.begins.push_back(component.neighbours.size());
  }
  for (const std::size_t node : component.nodes) number[node] = none;
  return component;
}

// Returns the number of edges on the shortest path from `from` to every node over nodes of `side`;
// `none` if there is no such path.
std::vector<std::size_t> count_steps_from(const Component& component, std::size_t from,
                                          std::span<const std::uint8_t> sides, std::uint8_t side) {
  std::vector<std::size_t> steps(component.size(), none);
  std::vector<std::size_t> queue{from};
  steps[from] = 0;
  for (std::size_t head = 0; head < queue.size(); ++head) {
    for (const std::size_t next : component.neighbours_of(queue[head])) {
      if (steps[next] != none || sides[next] != side) continue;
      steps[next] = steps[queue[head]] + 1;
      queue.push_back(next);
    }
  }
  return steps;
}

std::size_t find_farthest(std::span<const std::size_t> steps) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    if (steps[i] != none && (steps[best] == none || steps[i] > steps[best])) best = i;
  }
  return best;
}

// Approximates the second eigenvector of the random walk on a connected component by power
// iteration. Uses the lazy walk, whose eigenvalues are not negative, and subtracts the constant
// first eigenvector in each step.
std::vector<double> second_eigenvector(const Component& component, int iterations) {
  const std::vector<std::uint8_t> everywhere(component.size(), 0);
  const auto outermost = find_farthest(count_steps_from(component, 0, everywhere, 0));
  const auto steps = count_steps_from(component, outermost, everywhere, 0);
  std::vector<double> values(steps.begin(), steps.end());
  std::vector<double> relaxed(values.size());
  for (int i = 0; i <= iterations; ++i) {
    double sum = 0.0;
    double weight = 0.0;
    for (std::size_t n = 0; n < component.size(); ++n) {
      const auto degree = static_cast<double>(component.neighbours_of(n).size());
      sum += degree * values[n];
      weight += degree;
    }
    double largest = 0.0;
    for (double& value : values) {
      value -= sum / weight;
      largest = std::max(largest, std::abs(value));
    }
    if (i == iterations || largest == 0.0) break;
    for (std::size_t n = 0; n < component.size(); ++n) {
      double around = 0.0;
      for (const std::size_t next : component.neighbours_of(n)) around += values[next];
      relaxed[n] = 0.5 *
                   (values[n] + around / static_cast<double>(component.neighbours_of(n).size())) /
                   largest;
    }
    values.swap(relaxed);
  }
  return values;
}

// Returns 1 for the nodes before the smallest normalised cut in the order of `values`, 0 for the
// others.
std::vector<std::uint8_t> find_best_cut(const Component& component,
                                        std::span<const double> values) {
  std::vector<std::size_t> order(component.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, {}, [&](std::size_t n) { return values[n]; });
  std::vector<std::uint8_t> sides(component.size(), 0);
  const auto total = static_cast<double>(component.neighbours.size());
  const auto low =
      static_cast<std::size_t>(std::ceil(min_side_share * static_cast<double>(component.size())));
  double cut = 0.0;
  double volume = 0.0;
  double best = std::numeric_limits<double>::infinity();
  std::size_t best_count = component.size() / 2;
  for (std::size_t count = 1; count < component.size(); ++count) {
    const std::size_t node = order[count - 1];
    sides[node] = 1;
    volume += static_cast<double>(component.neighbours_of(node).size());
    for (const std::size_t next : component.neighbours_of(node))
      cut += sides[next] != 0 ? -1.0 : 1.0;
    if (count < low || component.size() - count < low) continue;
    const double normalised = cut / volume + cut / (total - volume);
    if (normalised < best) {
      best = normalised;
      best_count = count;
    }
  }
  std::ranges::fill(sides, std::uint8_t{0});
  for (std::size_t i = 0; i < best_count; ++i) sides[order[i]] = 1;
  return sides;
}

// Moves all nodes of a side, except those of its largest connected piece, to the other side.
void move_fragments(const Component& component, std::uint8_t side,
                    std::vector<std::uint8_t>& sides) {
  std::vector<std::size_t> piece(component.size(), none);
  std::vector<std::size_t> sizes;
  for (std::size_t n = 0; n < component.size(); ++n) {
    if (sides[n] != side || piece[n] != none) continue;
    const auto steps = count_steps_from(component, n, sides, side);
    sizes.push_back(0);
    for (std::size_t m = 0; m < component.size(); ++m) {
      if (steps[m] == none) continue;
      piece[m] = sizes.size() - 1;
      ++sizes.back();
    }
  }
  if (sizes.size() < 2) return;
  const auto largest = static_cast<std::size_t>(std::ranges::max_element(sizes) - sizes.begin());
  for (std::size_t n = 0; n < component.size(); ++n) {
    if (piece[n] == none || piece[n] == largest) continue;
    sides[n] = static_cast<std::uint8_t>(1 - side);
  }
}

// Returns the connected pieces of some nodes, each ascending, in the order of their first nodes.
std::vector<std::vector<std::size_t>> find_pieces(const NavigationGraph& graph,
                                                  const std::vector<std::size_t>& nodes,
                                                  std::vector<std::size_t>& number) {
  const Component component = make_component(graph, nodes, number);
  std::vector<std::uint8_t> visited(component.size(), 0);
  std::vector<std::vector<std::size_t>> result;
  for (std::size_t n = 0; n < component.size(); ++n) {
    if (visited[n] != 0) continue;
    const auto steps = count_steps_from(component, n, visited, 0);
    result.emplace_back();
    for (std::size_t m = 0; m < component.size(); ++m) {
      if (steps[m] == none) continue;
      visited[m] = 1;
      result.back().push_back(component.nodes[m]);
    }
  }
  return result;
}

}  // namespace

SubAreas make_single_area(const NavigationGraph& graph) {
  SubAreas areas;
  areas.area_of.assign(graph.size(), 0);
  areas.index_in_area.resize(graph.size());
  std::iota(areas.index_in_area.begin(), areas.index_in_area.end(), 0U);
  areas.nodes.push_back(areas.index_in_area);
  return areas;
}

SubAreas divide_into_areas(const NavigationGraph& graph, const SubAreaOptions& options) {
  validate(options);
  SubAreas areas;
  areas.area_of.resize(graph.size());
  areas.index_in_area.resize(graph.size());
  std::vector<std::size_t> number(graph.size(), none);
  std::vector<std::size_t> all(graph.size());
  std::iota(all.begin(), all.end(), 0U);
  std::vector<std::vector<std::size_t>> open = find_pieces(graph, all, number);
  // Stops bisecting when the whole is closer to the intended size than its halves, by ratio.
  const auto largest = static_cast<std::size_t>(std::sqrt(2.0) * options.views_per_area);
  while (!open.empty()) {
    std::vector<std::size_t> nodes = std::move(open.back());
    open.pop_back();
    if (nodes.size() <= std::max<std::size_t>(largest, 2)) {
      areas.nodes.push_back(std::move(nodes));
      continue;
    }
    const Component component = make_component(graph, std::move(nodes), number);
    std::vector<std::uint8_t> sides =
        find_best_cut(component, second_eigenvector(component, options.iterations));
    move_fragments(component, 1, sides);
    move_fragments(component, 0, sides);
    std::vector<std::size_t> half[2];
    for (std::size_t n = 0; n < component.size(); ++n) half[sides[n]].push_back(component.nodes[n]);
    for (const auto& side : half) {
      for (auto& piece : find_pieces(graph, side, number)) open.push_back(std::move(piece));
    }
  }
  std::ranges::sort(areas.nodes);
  for (std::size_t a = 0; a < areas.nodes.size(); ++a) {
    for (std::size_t index = 0; index < areas.nodes[a].size(); ++index) {
      areas.area_of[areas.nodes[a][index]] = a;
      areas.index_in_area[areas.nodes[a][index]] = index;
    }
  }
  for (std::size_t p = 0; p < graph.edges().size(); ++p) {
    const NavigationGraph::Edge& edge = graph.edges()[p];
    if (areas.area_of[*graph.node_of(edge.a)] != areas.area_of[*graph.node_of(edge.b)]) {
      areas.gates.push_back(p);
    }
  }
  return areas;
}

std::vector<std::uint8_t> find_bottlenecks(const NavigationGraph& graph, const SubAreas& areas,
                                           int links) {
  const auto ends_of = [&](std::size_t gate) {
    const NavigationGraph::Edge& edge = graph.edges()[gate];
    return std::pair(*graph.node_of(edge.a), *graph.node_of(edge.b));
  };
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> widths;
  const auto border_of = [&](std::size_t gate) {
    const auto [a, b] = ends_of(gate);
    return std::pair<std::size_t, std::size_t>(std::minmax(areas.area_of[a], areas.area_of[b]));
  };
  for (const std::size_t gate : areas.gates) ++widths[border_of(gate)];
  std::vector<std::size_t> ends;
  for (const std::size_t gate : areas.gates) {
    const auto border = border_of(gate);
    const std::size_t smaller =
        std::min(areas.nodes[border.first].size(), areas.nodes[border.second].size());
    const std::size_t width = widths[border];
    if (width * width > smaller) continue;
    const auto [a, b] = ends_of(gate);
    ends.push_back(a);
    ends.push_back(b);
  }
  std::vector<std::uint8_t> narrow(graph.size(), 0);
  for (const std::size_t node : nodes_around(graph, ends, links)) narrow[node] = 1;
  return narrow;
}

}  // namespace panonav
