#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/route_recorder.hpp"

namespace panonav::ros2 {

struct TeacherOptions {
  PictureSource pictures;
  std::optional<std::string> route;  ///< to record under this name
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

/// Makes a new memory file of a robot's first drive: views of places that are new (`LiveMemory`) or
/// half a metre from all others, with positions, and the drive as a route. One thread at a time.
class Teacher {
 public:
  /// Throws FileError when the file is there already, and as `LiveMemory`, `LineEncoder`.
  Teacher(std::filesystem::path memory, const TeacherOptions& options);

  /// An observation with pose and heading. Throws as `LiveMemory::answer` and `learn`.
  LiveMemory::Answer add(Observation seen);
  /// All is on the disk. Throws FileError; ContractError when nothing was added.
  void finish();

  [[nodiscard]] std::size_t views() const noexcept { return memory_.learnt(); }
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

 private:
  void record(const Observation& seen, const Pose2& pose);
  void store_lines();

  std::filesystem::path path_;
  TeacherOptions options_;
  LiveMemory memory_;
  LineEncoder encoder_;
  std::vector<Pose2> views_;
  std::optional<Pose2> last_line_;
  /// A new memory has its file late: until then lines wait here.
  std::vector<RouteRecorder::EncodedLine> waiting_;
  std::optional<RouteRecorder> recorder_;
  std::size_t lines_ = 0;
};

}  // namespace panonav::ros2
