#include "panonav/pipeline/observation_source.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/path.hpp"

namespace panonav {

Observation read_observation(const DatasetEntry& entry) {
  Observation observation(read_picture(entry));
  observation.name = entry.file;
  observation.file = entry.path;
  observation.stamp_s = entry.stamp_s;
  observation.odometry = entry.odometry;
  observation.pose = entry.pose;
  observation.tilt = entry.tilt;
  return observation;
}

std::vector<Pose2> dataset_poses(const Dataset& dataset) {
  std::vector<Pose2> poses;
  bool headings = true;
  for (const auto& entry : dataset.entries) {
    if (!entry.pose) return {};
    headings = headings && entry.pose->heading_rad;
    poses.push_back({entry.pose->x_m, entry.pose->y_m, entry.pose->heading_rad.value_or(0.0)});
  }
  if (headings || poses.size() < 2) return headings ? poses : std::vector<Pose2>{};
  return estimate_headings(positions_of(poses));
}

std::vector<Pose2> odometry_poses(const Dataset& dataset) {
  std::vector<Pose2> poses;
  for (const auto& entry : dataset.entries) {
    if (!entry.odometry) return {};
    poses.push_back(*entry.odometry);
  }
  return poses;
}

DatasetObservations::DatasetObservations(Dataset dataset, Executor& executor)
    : dataset_(std::move(dataset)), executor_(&executor) {}

std::optional<Observation> DatasetObservations::next() {
  if (next_ == size()) return std::nullopt;
  if (next_ == first_decoded_ + decoded_.size()) {
    first_decoded_ = next_;
    decoded_.clear();
    decoded_.resize(std::min(decoded_ahead, size() - next_));
    executor_->for_each_chunk(decoded_.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      try {
        decoded_[i].observation = read_observation(dataset_.entries[first_decoded_ + i]);
      } catch (const Error&) {
        decoded_[i].failure = std::current_exception();
      }
    });
  }
  Decoded& decoded = decoded_[next_++ - first_decoded_];
  if (decoded.failure) std::rethrow_exception(decoded.failure);
  return std::exchange(decoded.observation, std::nullopt);
}

}  // namespace panonav
