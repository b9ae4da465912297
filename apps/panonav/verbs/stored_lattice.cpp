#include "verbs/stored_lattice.hpp"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "panonav/mapping/lattice_map.hpp"

namespace panonav::command {

void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file) {
  std::set<std::pair<ViewId, ViewId>> known;
  for (const Link& link : memory.links()) known.insert(std::minmax(link.a, link.b));
  const TopologicalMap map = map_of(lattice);
  std::vector<Link> links;
  for (const MapEdge& edge : map.edges) {
    if (edge.weight < min_spring_weight || known.contains(std::minmax(edge.a, edge.b))) continue;
    links.push_back({edge.a, edge.b, edge.kind});
  }
  file.change([&] {
    file.link(links);
    file.save_map("lattice", map);
  });
}

}  // namespace panonav::command
