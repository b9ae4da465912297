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

/// Robots that go to remembered views of the office, over nothing but the arrangement of its views.
struct DemoNavigation {
  double within_m = 0.0;                     ///< half the views' spacing
  std::vector<simulation::MissionRun> runs;  ///< from random starts to random goals
  std::size_t arrived = 0;                   ///< within `within_m`, and they know it
  std::vector<double> detours;               ///< of those: way driven over the shortest one
  std::vector<double> steps;                 ///< of all
  simulation::MissionRun kidnapped;          ///< one more, kidnapped half way
  /// One more, a screen across its way; empty: no screen leaves a way round.
  std::optional<simulation::MissionRun> screened;
  viewer::UnfoldingMap all;  ///< the runs, one look after the other
  /// The first run as options of the verb `navigate`.
  std::vector<std::string> first_mission;
};

/// Runs the missions over the views of `memory`, the content of `file`, and adds a part that plays
/// them to the page, with a log. The same seed gives the same runs.
DemoNavigation demonstrate_navigation(const DemoOptions& options, const DemoRecordings& recordings,
                                      const MemoryFile& file, const VisualMemory& memory,
                                      const Lattice& arranged,
                                      std::shared_ptr<const ViewEncoder> pipeline, Session& session,
                                      viewer::ReportPage& page);

}  // namespace panonav::command
