#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/page.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

/// Particles of each image that a report on this many images shows; fewer for long runs, so that
/// the page stays a few megabytes.
[[nodiscard]] std::size_t count_shown_particles(std::size_t images);

/// Writes a page that plays the run, with the particles as in [M03] figures 7 to 9, and figures of
/// the whole run. `images`: at least one. Throws FileError.
void write_track_report(const std::filesystem::path& folder, const VisualMemory& memory,
                        double spacing_m, const std::vector<TrackedImage>& images,
                        const TrackSummary& summary, const viewer::RunPage& played);

}  // namespace panonav::command
