#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/route_recorder.hpp"

namespace panonav::ros2 {

struct TeacherOptions {
  PictureSource pictures;
  std::optional<std::string> route;  ///< name of the route to record; nullopt: none
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

/// Makes a new memory file from a robot's first drive: a map with loop closures (`Mapper`) whose
/// origin is the start of the drive, and the drive as a route. Not thread-safe.
class Teacher {
 public:
  /// Throws FileError if the file exists, and as `LineEncoder`.
  Teacher(std::filesystem::path memory, const TeacherOptions& options);

  /// Adds an observation with odometry, as a view only if the robot moved enough since the last
  /// view. Throws as `Mapper::add` and `LineEncoder::line`.
  void add(Observation observation);
  /// Maps the views, stores everything, and returns map_from_odometry at the end of the drive.
  /// Throws FileError, and ContractError if nothing was added.
  Pose2 finish();

  /// Returns map_from_odometry during the drive, where the start of the drive is the origin.
  [[nodiscard]] Pose2 map_from_odometry() const { return inverse(nodes_.front()); }
  [[nodiscard]] std::size_t views() const noexcept { return nodes_.size(); }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_.size(); }

 private:
  struct Line {
    RouteRecorder::EncodedLine encoded;  // with its pose by odometry
    std::size_t node = 0;                // index of the last node before the line
  };
  void make_mapper();
  void store_lines(const TopologicalMap& map);

  std::filesystem::path path_;
  TeacherOptions options_;
  LineEncoder encoder_;
  std::vector<Observation> scale_observations_;  // views from which the file's full scale is learnt
  std::optional<Mapper> mapper_;
  std::vector<Pose2> nodes_;  // poses by odometry
  std::vector<Line> lines_;
};

}  // namespace panonav::ros2
