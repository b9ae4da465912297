#pragma once

#include <filesystem>
#include <string>

#include "panonav_simulation/mission.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// Content of a mission's page, without the replay.
struct MissionReport {
  std::string goal;    ///< name of the goal view
  std::string reason;  ///< why the mission ended
  const simulation::MissionRun& run;
  viewer::MapPlot plot;  ///< the whole mission from above
};

/// Writes index.html with a replay of the mission and its map. Throws FileError.
void write_navigate_report(const std::filesystem::path& folder, const MissionReport& mission,
                           const viewer::RunPage& replay_page);

}  // namespace panonav::command
