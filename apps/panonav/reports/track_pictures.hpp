#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

/// Events and areas that a drawing of a tracked run shows besides its images.
struct TrackBackground {
  std::vector<viewer::MapLayer> surroundings;
  /// Index of the last image before the robot was kidnapped; nullopt if it was not kidnapped.
  std::optional<std::size_t> kidnapped_after;
};

/// Draws the true and the estimated path of a run from above, with the filter's state at each
/// image.
[[nodiscard]] viewer::MapPlot draw_track(const VisualMemory& memory,
                                         const std::vector<TrackedImage>& images,
                                         const TrackBackground& background);

}  // namespace panonav::command
