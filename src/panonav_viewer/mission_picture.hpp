#pragma once

#include <filesystem>
#include <string>

#include "panonav_simulation/mission.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// Returns a map of a mission run: obstacles, references with their directions to the goal, planned
/// path and driven path. References at unknown positions are omitted.
[[nodiscard]] MapPlot make_mission_plot(const std::string& title,
                                        const simulation::MissionPlace& place,
                                        const simulation::RememberedPlace& remembered,
                                        const PlannerOptions& options, ViewId goal,
                                        const simulation::MissionRun& run);
/// Writes the map of `make_mission_plot` as a PNG or SVG file. Throws as `write_plot`.
void write_mission_picture(const std::filesystem::path& path, const std::string& title,
                           const simulation::MissionPlace& place,
                           const simulation::RememberedPlace& remembered,
                           const PlannerOptions& options, ViewId goal,
                           const simulation::MissionRun& run);

}  // namespace panonav::viewer
