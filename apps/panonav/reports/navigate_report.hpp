#pragma once

#include <filesystem>
#include <string>

#include "experiments/runs/mission.hpp"
#include "reporting/plot.hpp"
#include "viewer/page.hpp"

namespace panonav::command {

/// What the page of a mission tells beside its run.
struct MissionReport {
  std::string goal;    ///< name of its view
  std::string reason;  ///< why it ended, in words
  const MissionRun& run;
  MapPlot plot;  ///< the whole of it from above
};

/// Writes index.html: the mission, decision by decision. Throws FileError.
void write_navigate_report(const std::filesystem::path& folder, const MissionReport& mission,
                           const RunPage& played);

}  // namespace panonav::command
