#include "panonav/pipeline/arrangement.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace panonav {

void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file) {
  std::set<std::pair<ViewId, ViewId>> known;
  for (const Link& link : memory.links()) known.insert(std::minmax(link.a, link.b));
  const TopologicalMap map = to_topological_map(lattice);
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

std::vector<CoarseMotion> make_coarse_motions(const Dataset& recording, const VisualMemory& memory,
                                              const CoarseMotionOptions& options) {
  std::vector<CoarseMotion> motions;
  std::optional<std::pair<ViewId, Pose2>> before;
  for (const DatasetEntry& entry : recording.entries) {
    const auto view = memory.find(entry.file);
    if (!view || !entry.odometry) continue;
    if (before && before->first != *view) {
      motions.push_back(make_coarse_motion(before->first, *view,
                                           inverse(before->second) * *entry.odometry, options));
    }
    before = {*view, *entry.odometry};
  }
  return motions;
}

}  // namespace panonav
