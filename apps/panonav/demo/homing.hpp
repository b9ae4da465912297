#pragma once

#include <cstdint>
#include <vector>

#include "cli/session.hpp"
#include "lab/runs/homing_run.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Results of simulated drives home, each with one view of the home and from a distance of one
/// metre.
struct DemoHoming {
  std::vector<lab::HomingRun> runs;
  std::size_t arrived = 0;          ///< runs that ended within 10 cm and reported it
  std::vector<double> distances_m;  ///< distance from home at the end of each run
};

/// Simulates the drives and adds a part with their animation to the page. The same seed gives the
/// same runs.
DemoHoming demonstrate_homing(const simulation::Scene& office, int runs, std::uint64_t seed,
                              Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
