#include "panonav/pipeline/estimate_evaluation.hpp"

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

namespace {

TrajectoryEstimate read_map(const std::filesystem::path& path) {
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  auto map = file.map("map");
  if (!map || map->nodes.empty()) {
    throw FileError(path.string(),
                    file.info().views_with_position > 0
                        ? "has positions from a data set and no map of its own to compare; make "
                          "one with panonav map, or choose a file of estimated poses"
                        : "contains no map; make one with panonav map or panonav memorise");
  }
  const VisualMemory memory = file.load();
  TrajectoryEstimate estimate;
  estimate.trajectory.format = "map";
  estimate.trajectory.units.is_metric = read_map_unit(file) == LengthUnit::metres;
  auto& poses = estimate.trajectory.poses;
  for (const TopologicalMap::Node& node : map->nodes) {
    const auto& stamp_s = memory.info(node.view).stamp_s;
    if (!stamp_s) {
      throw FileError(path.string(),
                      "view " + memory.info(node.view).name +
                          " has no stamp, by which its true pose is found; memorise a video, a "
                          "recording or a data set with the column 'stamp_s' in a new memory, or "
                          "choose a file of estimated poses");
    }
    estimate.stamp_s.emplace(node.view, *stamp_s);
    if (node.component == map->nodes.front().component) {
      poses.push_back({*stamp_s, to_pose3(node.pose)});
    }
  }
  std::ranges::sort(poses, {}, &StampedPose3::stamp_s);
  estimate.map = std::move(map);
  return estimate;
}

EstimateEvaluation::Pairing choose_pairing(TrajectoryUnits::Times estimate,
                                           TrajectoryUnits::Times truth) {
  using Times = TrajectoryUnits::Times;
  if (estimate != truth || estimate == Times::none) return EstimateEvaluation::Pairing::order;
  return estimate == Times::stamps ? EstimateEvaluation::Pairing::stamp
                                   : EstimateEvaluation::Pairing::image_number;
}

void number_poses(std::vector<StampedPose3>& poses) {
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].stamp_s = static_cast<double>(i);
}

std::optional<MapComparison> compare_shapes(std::span<const StampedPose3> estimate,
                                            std::span<const StampedPose3> truth,
                                            double max_stamp_difference_s) {
  std::vector<Point2> map;
  std::vector<Point2> known;
  for (const PosePair& pair : pair_by_stamp(estimate, truth, max_stamp_difference_s)) {
    map.push_back(to_pose2(estimate[pair.estimate].pose).position());
    known.push_back(to_pose2(truth[pair.truth].pose).position());
  }
  return compare_positions(map, known);
}

}  // namespace

TrajectoryEstimate read_estimate(const std::filesystem::path& path) {
  if (path.extension() == ".panonav") return read_map(path);
  return {read_trajectory_file(path), {}, {}};
}

std::optional<EstimateEvaluation> evaluate_estimate(TrajectoryEstimate estimate,
                                                    TrajectoryFile truth,
                                                    const TrajectoryError::Options& options) {
  using Pairing = EstimateEvaluation::Pairing;
  EstimateEvaluation evaluation;
  if (estimate.trajectory.units.is_metric != truth.units.is_metric &&
      options.align != TrajectoryError::Align::similarity) {
    throw ContractError("align", "without a scale",
                        "similarity, as either the estimate or the truth is in view steps");
  }
  evaluation.pairing = choose_pairing(estimate.trajectory.units.times, truth.units.times);
  TrajectoryError::Options matching = options;
  if (evaluation.pairing != Pairing::stamp) matching.max_stamp_difference_s = 0.0;
  auto& poses = estimate.trajectory.poses;
  if (evaluation.pairing == Pairing::order) {
    require(poses.size() == truth.poses.size(), "number of estimated poses",
            static_cast<double>(poses.size()),
            to_text(static_cast<double>(truth.poses.size())) +
                ", the number of true poses, as poses without stamps are paired by their order");
    number_poses(poses);
    number_poses(truth.poses);
  }
  auto error = trajectory_error(poses, truth.poses, matching);
  if (!error) return std::nullopt;
  evaluation.trajectory = std::move(*error);
  evaluation.has_rotations = estimate.trajectory.has_rotations && truth.has_rotations;
  if (!evaluation.has_rotations) evaluation.trajectory.relative_pairs = 0;
  const double max_difference_s = matching.max_stamp_difference_s;
  if (is_planar(poses) && is_planar(truth.poses)) {
    evaluation.map = compare_shapes(poses, truth.poses, max_difference_s);
  }
  if (estimate.map && truth.units.is_metric) {
    evaluation.closures = count_closures(*estimate.map, [&](ViewId view) -> std::optional<Point2> {
      const std::vector<StampedPose3> seen{{estimate.stamp_s.at(view), {}}};
      const auto pair = pair_by_stamp(seen, truth.poses, max_difference_s);
      if (pair.empty()) return std::nullopt;
      return to_pose2(truth.poses[pair.front().truth].pose).position();
    });
  }
  return evaluation;
}

}  // namespace panonav
