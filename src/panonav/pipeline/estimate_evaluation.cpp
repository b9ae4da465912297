#include "panonav/pipeline/estimate_evaluation.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

namespace {

/// The estimate: a trajectory and, if it comes from a memory file, its map.
struct Estimate {
  Trajectory trajectory;
  std::optional<TopologicalMap> map;
  std::map<ViewId, double> stamp_s;  // of the map's views
};

/// Reads a map stored by `Mapper`; the trajectory consists of the poses of its first component.
Estimate read_map(const std::filesystem::path& path) {
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  auto map = file.map("map");
  if (!map || map->nodes.empty()) {
    throw FileError(path.string(), "contains no map; allowed: a memory file that panonav map made");
  }
  const VisualMemory memory = file.load();
  Estimate estimate;
  std::vector<StampedPose> poses;
  for (const TopologicalMap::Node& node : map->nodes) {
    const auto& stamp_s = memory.info(node.view).stamp_s;
    if (!stamp_s) {
      throw FileError(path.string(),
                      "view " + memory.info(node.view).name +
                          " has no stamp; allowed: a recording with the column 'stamp_s'");
    }
    estimate.stamp_s.emplace(node.view, *stamp_s);
    if (node.component == map->nodes.front().component) poses.push_back({*stamp_s, node.pose});
  }
  std::ranges::sort(poses, {}, &StampedPose::stamp_s);
  estimate.trajectory = Trajectory(poses);
  estimate.map = std::move(map);
  return estimate;
}

std::optional<MapComparison> compare_shapes(const Trajectory& estimate, const Trajectory& truth,
                                            double max_gap_s) {
  std::vector<Point2> map;
  std::vector<Point2> known;
  for (const StampedPose& pose : estimate.poses()) {
    const auto true_pose = truth.at(pose.stamp_s, max_gap_s);
    if (!true_pose) continue;
    map.push_back(pose.pose.position());
    known.push_back(true_pose->position());
  }
  return compare_positions(map, known);
}

}  // namespace

std::optional<EstimateEvaluation> evaluate_estimate(const std::filesystem::path& estimate_path,
                                                    const std::filesystem::path& truth_path,
                                                    const TrajectoryError::Options& options) {
  const Estimate estimate = estimate_path.extension() == ".panonav"
                                ? read_map(estimate_path)
                                : Estimate{Trajectory(read_trajectory(estimate_path)), {}, {}};
  const Trajectory truth(read_trajectory(truth_path));
  const auto error = trajectory_error(estimate.trajectory, truth, options);
  if (!error) return std::nullopt;
  EstimateEvaluation evaluation{
      *error, compare_shapes(estimate.trajectory, truth, options.max_gap_s), {}};
  if (estimate.map) {
    evaluation.closures = count_closures(*estimate.map, [&](ViewId view) -> std::optional<Point2> {
      const auto pose = truth.at(estimate.stamp_s.at(view), options.max_gap_s);
      return pose ? std::optional(pose->position()) : std::nullopt;
    });
  }
  return evaluation;
}

}  // namespace panonav
