#pragma once

#include <filesystem>
#include <string>

#include "panonav_simulation/mission.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// A run from above: what stands around, the references with the direction that each has towards
/// the goal, the way planned and the way driven. References whose place nobody knows are left out.
[[nodiscard]] MapPlot mission_plot(const std::string& title, const simulation::MissionPlace& place,
                                   const simulation::RememberedPlace& remembered,
                                   const PlannerOptions& options, ViewId goal,
                                   const simulation::MissionRun& run);
/// The same as a PNG or SVG file. Throws as `write_plot`.
void write_mission_picture(const std::filesystem::path& path, const std::string& title,
                           const simulation::MissionPlace& place,
                           const simulation::RememberedPlace& remembered,
                           const PlannerOptions& options, ViewId goal,
                           const simulation::MissionRun& run);

}  // namespace panonav::viewer
