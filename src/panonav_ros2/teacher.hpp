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
  std::optional<std::string> route;  ///< to record under this name
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

/// Makes a new memory file of a robot's first drive: a map whose loops are closed (`Mapper`), in
/// whose frame the drive begins at the origin, and the drive as a route. One thread at a time.
class Teacher {
 public:
  /// Throws FileError when the file exists, and as `LineEncoder`.
  Teacher(std::filesystem::path memory, const TeacherOptions& options);

  /// Adds an observation with odometry, as a view if the robot moved since the last one. Throws as
  /// `Mapper::add` and `LineEncoder::line`.
  void add(Observation observation);
  /// Maps the views, stores all, and returns map_from_odometry at the end of the drive. Throws
  /// FileError; ContractError when nothing was added.
  Pose2 finish();

  /// Returns the frame until the drive ends: its beginning is the origin.
  [[nodiscard]] Pose2 map_from_odometry() const { return inverse(nodes_.front()); }
  [[nodiscard]] std::size_t views() const noexcept { return nodes_.size(); }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_.size(); }

 private:
  struct Line {
    RouteRecorder::EncodedLine encoded;  // with the pose of the odometry
    std::size_t node = 0;                // the last one before
  };
  void make_mapper();
  void store_lines(const TopologicalMap& map);

  std::filesystem::path path_;
  TeacherOptions options_;
  LineEncoder encoder_;
  std::vector<Observation> waiting_;  // for the full scale of the new file
  std::optional<Mapper> mapper_;
  std::vector<Pose2> nodes_;  // by the odometry
  std::vector<Line> lines_;
};

}  // namespace panonav::ros2
