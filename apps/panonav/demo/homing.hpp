#pragma once

#include <cstdint>
#include <vector>

#include "cli/session.hpp"
#include "lab/runs/homing_run.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Runs robots home to places in the office, each from one view of the place and about a metre
/// away.
struct DemoHoming {
  std::vector<lab::HomingRun> runs;
  std::size_t arrived = 0;          ///< within 10 cm, and they know it
  std::vector<double> distances_m;  ///< between home and where each run ended
};

/// Runs them and adds a part that plays them to the page. The same seed gives the same runs.
DemoHoming demonstrate_homing(const simulation::Scene& office, int runs, std::uint64_t seed,
                              Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
