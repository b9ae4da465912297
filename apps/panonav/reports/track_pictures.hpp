#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "reporting/plot.hpp"
#include "verbs/tracked_run.hpp"

namespace panonav::command {

/// What is drawn below a tracked run.
struct TrackBackground {
  std::vector<MapLayer> surroundings;
  /// The last image before the robot was kidnapped; empty: it was not.
  std::optional<std::size_t> kidnapped_after;
};

/// True and estimated path of a run from above, and what the filter said of each image. Throws as
/// `write_plot`.
void draw_track_map(const VisualMemory& memory, const std::vector<TrackedImage>& images,
                    const TrackBackground& background, const std::filesystem::path& path);

/// The particles after some images of a run, side by side [M03 figures 7 to 9]. `at_first`: those
/// before the first image, drawn first unless there are none.
void draw_track_snapshots(const VisualMemory& memory, const std::vector<TrackedImage>& images,
                          const std::set<std::size_t>& shown, const TrackBackground& background,
                          const std::filesystem::path& path,
                          const std::vector<Point2>& at_first = {});

}  // namespace panonav::command
