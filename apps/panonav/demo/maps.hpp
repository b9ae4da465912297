#pragma once

#include <cstdint>
#include <optional>

#include "cli/session.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "reports/lattice_picture.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Maps made from the memory's views.
struct DemoMaps {
  Lattice arranged;                      ///< the office, its views in no order
  std::optional<MapComparison> lattice;  ///< beside the truth
  double map_error = 1.0;                ///< shape difference of a map from a drive
  double wheels_error = 1.0;             ///< of the wheels on the same drive
  double map_rms_m = 0.0;                ///< of the map laid over the true way, in equal size
  double wheels_rms_m = 0.0;
};

/// Arranges the views of `office` without their poses, makes a map of a drive through rooms of
/// another place, and adds a part to the page that plays the first and
/// draws the second.
DemoMaps demonstrate_maps(const VisualMemory& office, std::uint64_t seed, bool quick,
                          Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
