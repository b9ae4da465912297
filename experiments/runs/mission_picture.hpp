#pragma once

#include <filesystem>
#include <string>

#include "experiments/runs/mission.hpp"

namespace panonav {

/// Draws a run from above into a PNG or SVG file: what stands around, the references with the
/// direction that each has towards the goal, the way planned and the way driven. References whose
/// place nobody knows are left out. Throws as `write_plot`.
void write_mission_picture(const std::filesystem::path& path, const std::string& title,
                           const MissionPlace& place, const RememberedPlace& remembered,
                           const PlannerOptions& options, ViewId goal, const MissionRun& run);

}  // namespace panonav
