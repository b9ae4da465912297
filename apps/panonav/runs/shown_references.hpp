#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav_recordings/run_recorder.hpp"

namespace panonav::command {

/// The views of a memory with known positions, prepared for the display of a run.
class ShownReferences {
 public:
  explicit ShownReferences(const VisualMemory& memory, LengthUnit unit = LengthUnit::metres);

  /// Adds positions, names and Voronoi cells of all views to the moment. Needed for the first
  /// moment and whenever the views have changed.
  void add_to(recordings::RunMoment& moment) const;
  /// Adds the dissimilarities between `view` and its 1000 most similar references. Cost: one
  /// search of the memory.
  void compare(recordings::RunMoment& moment, const VisualMemory& memory,
               const PackedSignature& view) const;

 private:
  LengthUnit unit_;
  std::vector<Point2> positions_;
  std::vector<recordings::RunReference> views_;
  std::unordered_map<ViewId, std::size_t> position_index_;
};

/// Returns the Voronoi cells of the positions with the area of each position; without `areas` all
/// are in area 0. Empty for more than 5000 positions, which nobody could tell apart, and for fewer
/// than two.
[[nodiscard]] std::vector<recordings::RunRegion> voronoi_regions(
    const std::vector<Point2>& positions, const std::vector<std::size_t>& areas = {});

/// Measures the durations of the stages of a moment.
class StageClock {
 public:
  /// Ends the current stage, which began when the stage before it ended, and stores its duration.
  void stage(const char* name) { part(name, std::chrono::steady_clock::now() - since_); }
  /// Stores this part of the current stage as a separate stage and excludes it from the current
  /// one.
  void part(const char* name, std::chrono::steady_clock::duration duration) {
    add(name, std::chrono::duration<double, std::milli>(duration).count());
    since_ += duration;
  }
  /// Adds a stage whose duration was measured elsewhere.
  void add(const char* name, double ms) { stages_.emplace_back(name, ms); }
  /// Discards the time since the last stage.
  void restart() { since_ = std::chrono::steady_clock::now(); }
  /// Moves the measured stages to the end of the moment's stages.
  void add_to(recordings::RunMoment& moment) {
    for (auto& one : stages_) moment.stages_ms.push_back(std::move(one));
    stages_.clear();
  }

 private:
  std::vector<std::pair<std::string, double>> stages_;
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

}  // namespace panonav::command
