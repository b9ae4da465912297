#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.hpp"
#include "demo/recordings.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_simulation/mission.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Results of missions to stored views of the office, planned on the arrangement of its views.
struct DemoNavigation {
  double within_m = 0.0;  ///< accepted distance from the goal: half the views' spacing
  std::vector<simulation::MissionRun> runs;  ///< from random starts to random goals
  std::size_t arrived = 0;                   ///< runs that ended within `within_m` and reported it
  std::vector<double> detours;               ///< ratio of driven to shortest path, of arrived runs
  std::vector<double> steps;                 ///< number of steps of each run
  simulation::MissionRun kidnapped;          ///< another run, kidnapped in the middle of its path
  /// Another run, with a screen across its path; nullopt if each screen would block all paths.
  std::optional<simulation::MissionRun> screened;
  viewer::MapAnimation all;  ///< animation of the runs, one frame per image
  /// The first run as options of the verb `navigate`.
  std::vector<std::string> first_mission;
};

/// Simulates the missions with the views of `memory`, which was loaded from `file`. Adds a part
/// with their animation to the page and writes a log. The same seed gives the same runs.
DemoNavigation demonstrate_navigation(const DemoOptions& options, const DemoRecordings& recordings,
                                      const MemoryFile& file, const VisualMemory& memory,
                                      const Lattice& arranged,
                                      std::shared_ptr<const ViewEncoder> encoder, Session& session,
                                      viewer::ReportPage& page);

}  // namespace panonav::command
