#pragma once

#include <filesystem>
#include <string>

#include "panonav_simulation/mission.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// The content of a mission's page besides its run.
struct MissionReport {
  std::string goal;    ///< name of its view
  std::string reason;  ///< why it ended, in words
  const simulation::MissionRun& run;
  viewer::MapPlot plot;  ///< the whole of it from above
};

/// Writes index.html: the mission, decision by decision. Throws FileError.
void write_navigate_report(const std::filesystem::path& folder, const MissionReport& mission,
                           const viewer::RunPage& played);

}  // namespace panonav::command
