#include "panonav/mapping/lattice_map.hpp"

namespace panonav {

TopologicalMap map_of(const Lattice& lattice) {
  TopologicalMap map;
  for (const Lattice::Node& node : lattice.nodes)
    map.nodes.push_back({node.view, node.pose, node.component});
  for (const Lattice::Spring& spring : lattice.springs) {
    const Lattice::Node& a = lattice.nodes[spring.a];
    const Lattice::Node& b = lattice.nodes[spring.b];
    map.edges.push_back({.a = a.view,
                         .b = b.view,
                         .a_from_b = inverse(a.pose) * b.pose,
                         .kind = LinkKind::neighbour,
                         .weight = spring.weight});
  }
  return map;
}

}  // namespace panonav
