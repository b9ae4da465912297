#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "verbs/tracked_run.hpp"

namespace panonav::command {

/// Makes the folder for a report. Throws FileError on a folder that holds anything but an earlier
/// report.
void prepare_track_report(const std::filesystem::path& folder);

/// Particles of each image that a report on this many images shows; fewer for long runs, so that
/// the animation stays a few megabytes.
[[nodiscard]] std::size_t particles_shown(std::size_t images);

/// A page with pictures like [M03] figures 7 to 9, and the animation of the run. `images`: at least
/// one. Throws Error when gnuplot is not installed, FileError.
void write_track_report(const std::filesystem::path& folder, const VisualMemory& memory,
                        double spacing_m, const std::vector<TrackedImage>& images,
                        const TrackSummary& summary);

}  // namespace panonav::command
