#include "panonav/mapping/lattice_map.hpp"

namespace panonav {

TopologicalMap map_of(const Lattice& lattice) {
  TopologicalMap map;
  for (const LatticeNode& node : lattice.nodes)
    map.nodes.push_back({node.view, node.pose, node.component});
  for (const LatticeSpring& spring : lattice.springs) {
    const LatticeNode& a = lattice.nodes[spring.a];
    const LatticeNode& b = lattice.nodes[spring.b];
    map.edges.push_back({.a = a.view,
                         .b = b.view,
                         .a_from_b = inverse(a.pose) * b.pose,
                         .kind = LinkKind::neighbour,
                         .weight = spring.weight});
  }
  return map;
}

}  // namespace panonav
