#include "panonav/pipeline/arrangement.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav {

void store_lattice(const Lattice& lattice, const VisualMemory& memory, MemoryFile& file) {
  std::set<std::pair<ViewId, ViewId>> known;
  for (const Link& link : memory.links()) known.insert(std::minmax(link.a, link.b));
  const TopologicalMap map = to_topological_map(lattice);
  std::vector<Link> links;
  for (const TopologicalMap::Edge& edge : map.edges) {
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

std::size_t count_rejected_springs(const Lattice& lattice) {
  return static_cast<std::size_t>(std::ranges::count_if(
      lattice.springs, [](const auto& spring) { return spring.weight < min_spring_weight; }));
}

bool has_stamps(const Lattice& lattice, const VisualMemory& memory) {
  return std::ranges::all_of(lattice.nodes, [&](const Lattice::Node& node) {
    return memory.info(node.view).stamp_s.has_value();
  });
}

std::vector<StampedPose> make_trajectory(const Lattice& lattice, const VisualMemory& memory) {
  const bool stamped = has_stamps(lattice, memory);
  std::vector<StampedPose> trajectory;
  for (const Lattice::Node& node : lattice.nodes) {
    if (node.component != 0) continue;
    trajectory.push_back(
        {stamped ? *memory.info(node.view).stamp_s : static_cast<double>(node.view.value),
         node.pose});
  }
  std::ranges::stable_sort(trajectory, {}, &StampedPose::stamp_s);
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    if (trajectory[i].stamp_s > trajectory[i - 1].stamp_s) continue;
    throw ContractError("stamp_s of a view", to_text(trajectory[i].stamp_s),
                        "for a trajectory: different for each view");
  }
  return trajectory;
}

std::pair<std::vector<Point2>, std::vector<Point2>> collect_known_positions(
    const Lattice& lattice, const VisualMemory& memory) {
  std::pair<std::vector<Point2>, std::vector<Point2>> positions;
  for (const Lattice::Node& node : lattice.nodes) {
    const auto& pose = memory.info(node.view).pose;
    if (node.component != 0 || !pose) continue;
    positions.first.push_back(node.pose.position());
    positions.second.push_back(pose->position());
  }
  return positions;
}

std::optional<MapComparison> compare_with_ground_truth(const Lattice& lattice,
                                                       const VisualMemory& memory) {
  const auto [arranged, truth] = collect_known_positions(lattice, memory);
  return compare_positions(arranged, truth);
}

}  // namespace panonav
