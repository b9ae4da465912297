#pragma once

#include <filesystem>

#include "runs/trial.hpp"

namespace panonav::command {

/// Writes a page with the verdict on a user's own images, the map, the answer for each image, an
/// example of an image as panonav reads it, and the next commands. Throws FileError.
void write_try_report(const std::filesystem::path& folder, const Trial& trial,
                      const TrialVerdict& verdict);

}  // namespace panonav::command
