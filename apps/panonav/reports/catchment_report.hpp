#pragma once

#include <filesystem>

#include "panonav/pipeline/catchment_survey.hpp"

namespace panonav::command {

/// Writes index.html with curves, a map of all catchment areas, and maps for the home view with
/// index `goal`. Throws FileError.
void write_catchment_report(const std::filesystem::path& folder, const RecordedViews& goals,
                            const RecordedViews& places, const CatchmentResult& result,
                            const FourierHomingOptions& homing, std::size_t goal);

}  // namespace panonav::command
