#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav_recordings/run_recorder.hpp"

namespace panonav::command {

/// The views of a memory whose positions are known, as a run shows them.
class ShownReferences {
 public:
  explicit ShownReferences(const VisualMemory& memory);

  /// Positions, names and Voronoi cells: of the first moment, and when there are others.
  void add_to(recordings::RunMoment& moment) const;
  /// Adds the similarities of the view to its 1000 most similar references. Cost: a search that
  /// sorts them.
  void compare(recordings::RunMoment& moment, const VisualMemory& memory,
               const PackedSignature& view) const;

 private:
  std::vector<Point2> positions_;
  std::vector<recordings::RunReference> views_;
  std::unordered_map<ViewId, std::size_t> place_of_;
};

/// The cells of positions, all of one area or of those given by position. Empty where there are
/// more than anybody sees apart, 5000, or fewer than two.
[[nodiscard]] std::vector<recordings::RunRegion> voronoi_regions(
    const std::vector<Point2>& positions, const std::vector<std::size_t>& areas = {});

/// Notes how long the stages of a moment take.
class StageClock {
 public:
  /// The stage since the one before ends here.
  void stage(const char* name) { part(name, std::chrono::steady_clock::now() - since_); }
  /// Counts this part of the current stage as another stage.
  void part(const char* name, std::chrono::steady_clock::duration duration) {
    add(name, std::chrono::duration<double, std::milli>(duration).count());
    since_ += duration;
  }
  /// Measured elsewhere, before.
  void add(const char* name, double ms) { stages_.emplace_back(name, ms); }
  /// Discards the time since the last stage.
  void restart() { since_ = std::chrono::steady_clock::now(); }
  /// Appends them to the moment's.
  void add_to(recordings::RunMoment& moment) {
    for (auto& one : stages_) moment.stages_ms.push_back(std::move(one));
    stages_.clear();
  }

 private:
  std::vector<std::pair<std::string, double>> stages_;
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

}  // namespace panonav::command
