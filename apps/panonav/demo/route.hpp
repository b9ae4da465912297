#pragma once

#include <cstdint>

#include "cli/session.hpp"
#include "lab/y03/routes.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// A route through the office, remembered as one line of pixels a step, and robots that repeat it.
struct DemoRoute {
  double length_m = 0.0;
  std::size_t bytes = 0;            ///< of all lines
  std::vector<lab::RouteRun> runs;  ///< forward, then back
  std::size_t completed = 0;        ///< at the end of the route, and they know it
  std::vector<double> lateral_m;    ///< from the route, from a metre behind the start on
  std::vector<double> position_m;   ///< errors of the fixes
};

/// Records and repeats it and adds a part that plays it to the page. The same seed gives the same
/// runs.
DemoRoute demonstrate_route(const simulation::Scene& office, double length_m, std::uint64_t seed,
                            Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
