#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "panonav/pipeline/tracker.hpp"
#include "panonav_viewer/page.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

/// Returns the number of particles per image in a report on this many images. It is smaller for
/// long runs, so that the page has only a few megabytes.
[[nodiscard]] std::size_t count_shown_particles(std::size_t images);

/// Writes a page that replays the run with its particles, as in [M03] figures 7 to 9, and plots of
/// the whole run. `images` must not be empty. Throws FileError.
void write_track_report(const std::filesystem::path& folder, const Tracker& tracker,
                        const std::vector<TrackedImage>& images, const TrackSummary& summary,
                        const viewer::RunPage& replay_page);

}  // namespace panonav::command
