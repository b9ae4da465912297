#include "panonav/mapping/topological_map.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav {

void validate(const TopologicalMap& map) {
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const TopologicalMap::Node& node = map.nodes[i];
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
    const TopologicalMap::Edge& edge = map.edges[i];
    const std::string name = "edge " + std::to_string(i);
    const auto is_node = [&](ViewId view) {
      return std::ranges::binary_search(map.nodes, view, {}, &TopologicalMap::Node::view);
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
  for (const TopologicalMap::Node& node : map.nodes) numbers.emplace(node.component, 0);
  std::size_t next = 0;
  for (auto& [component, number] : numbers) number = next++;
  for (TopologicalMap::Node& node : map.nodes) node.component = numbers.at(node.component);
}

std::size_t count_components(const TopologicalMap& map) {
  std::set<std::size_t> components;
  for (const TopologicalMap::Node& node : map.nodes) components.insert(node.component);
  return components.size();
}

std::vector<std::size_t> count_nodes(const TopologicalMap& map) {
  std::vector<std::size_t> counts;
  for (const TopologicalMap::Node& node : map.nodes) {
    counts.resize(std::max(counts.size(), node.component + 1), 0);
    ++counts[node.component];
  }
  return counts;
}

}  // namespace panonav
