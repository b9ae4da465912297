#pragma once

#include <cstdint>

#include "cli/session.hpp"
#include "lab/y03/routes.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// A route through the office, stored as one line of pixels per step, and the results of robots
/// that repeat it.
struct DemoRoute {
  double length_m = 0.0;
  std::size_t bytes = 0;            ///< size of all lines, uncompressed
  std::vector<lab::RouteRun> runs;  ///< one forward, one back
  std::size_t completed = 0;        ///< runs that reached the end and reported it
  std::vector<double> lateral_m;    ///< distances from the route after the first metre
  std::vector<double> position_m;   ///< errors of the fixes
};

/// Records the route, repeats it, and adds a part with a replay to the page. The same seed gives
/// the same runs.
DemoRoute demonstrate_route(const simulation::Scene& office, double length_m, std::uint64_t seed,
                            Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
