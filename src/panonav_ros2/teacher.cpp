#include "panonav_ros2/teacher.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/trajectory.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::ros2 {

namespace {

std::filesystem::path require_new(std::filesystem::path path) {
  if (memory_exists(path)) {
    throw FileError(path.string(), "exists; allowed for a first drive: a new file");
  }
  return path;
}

}  // namespace

Teacher::Teacher(std::filesystem::path memory, const TeacherOptions& options)
    : path_(require_new(std::move(memory))), options_(options), encoder_(options.pictures, {}) {}

void Teacher::make_mapper() {
  Executor alone;
  mapper_.emplace(MemoryFile::create(
                      path_, make_memory_header(scale_observations_, options_.pictures,
                                                options_.signature, options_.preprocessing, alone)),
                  options_.pictures);
  for (const Observation& first : std::exchange(scale_observations_, {})) mapper_->add(first);
}

void Teacher::add(Observation observation) {
  // Half of the usual spacing of reference grids: views must be near enough for visual odometry
  // between them, and a returning robot finds a view nearby.
  constexpr double step_m = 0.25;
  constexpr double turn_rad = 0.3;
  const Pose2 pose = observation.odometry.value();
  if (options_.route && (lines_.empty() || RouteRecorder::is_due(lines_.back().encoded.pose, pose,
                                                                 RouteRecorderOptions{}.every_m))) {
    lines_.push_back({{pose, encoder_.line(observation)}, nodes_.empty() ? 0 : nodes_.size() - 1});
  }
  if (!nodes_.empty() && distance(nodes_.back().position(), pose.position()) < step_m &&
      std::abs(angle_difference(pose.heading_rad, nodes_.back().heading_rad)) < turn_rad) {
    return;
  }
  if (mapper_) {
    mapper_->add(observation);
  } else {
    scale_observations_.push_back(std::move(observation));
    if (scale_observations_.size() == Memoriser::scale_views) make_mapper();
  }
  nodes_.push_back(pose);
}

/// Corrects each line's pose by the corrections of the nodes before and after it, weighted by its
/// position between them, and stores the route.
void Teacher::store_lines(const TopologicalMap& map) {
  RouteRecorder recorder(
      MemoryFile::open(path_, Access::read_write), options_.pictures,
      RouteRecorderOptions{.name = *options_.route, .line = {}, .horizon_rows = {}});
  for (Line& line : lines_) {
    const std::size_t before = line.node;
    const std::size_t after = std::min(before + 1, nodes_.size() - 1);
    Pose2& pose = line.encoded.pose;
    const auto correct_by_node = [&](std::size_t node) {
      return map.nodes[node].pose * inverse(nodes_[node]) * pose;
    };
    const double from_m = distance(nodes_[before].position(), pose.position());
    const double to_m = distance(nodes_[after].position(), pose.position());
    const double share = from_m > 0.0 ? from_m / (from_m + to_m) : 0.0;
    pose = interpolate(correct_by_node(before), correct_by_node(after), share);
    recorder.add(std::move(line.encoded));
  }
  (void)recorder.finish();
}

Pose2 Teacher::finish() {
  if (nodes_.empty()) throw ContractError("views that were taught", 0.0, "1 or more");
  if (!mapper_) make_mapper();
  const TopologicalMap map = mapper_->finish().map;
  mapper_.reset();  // closes the file
  if (options_.route) store_lines(map);
  return map.nodes.back().pose * inverse(nodes_.back());
}

}  // namespace panonav::ros2
