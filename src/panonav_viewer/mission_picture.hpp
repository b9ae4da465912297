#pragma once

#include <filesystem>
#include <string>

#include "panonav_simulation/mission.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// Returns a run from above: obstacles, references with their directions towards the goal, planned
/// path and driven path. References with unknown places are left out.
[[nodiscard]] MapPlot mission_plot(const std::string& title, const simulation::MissionPlace& place,
                                   const simulation::RememberedPlace& remembered,
                                   const PlannerOptions& options, ViewId goal,
                                   const simulation::MissionRun& run);
/// Writes the same as a PNG or SVG file. Throws as `write_plot`.
void write_mission_picture(const std::filesystem::path& path, const std::string& title,
                           const simulation::MissionPlace& place,
                           const simulation::RememberedPlace& remembered,
                           const PlannerOptions& options, ViewId goal,
                           const simulation::MissionRun& run);

}  // namespace panonav::viewer
