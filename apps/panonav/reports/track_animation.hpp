#pragma once

#include <filesystem>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "verbs/tracked_run.hpp"

namespace panonav::command {

/// Writes a page that plays a run from above: references, particles, estimate, true and estimated
/// path, image by image. One file with its script and data in it; needs nothing else and nothing
/// from the network. `spacing_m`: of the references. Throws FileError.
void write_track_animation(const std::filesystem::path& path, const VisualMemory& memory,
                           double spacing_m, const std::vector<TrackedImage>& images);

}  // namespace panonav::command
