#pragma once

#include <cstdint>
#include <optional>

#include "cli/session.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "reports/lattice_picture.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// Maps made from the views of the office and of a drive.
struct DemoMaps {
  Lattice arranged;                      ///< arrangement of the office's unordered views
  std::optional<MapComparison> lattice;  ///< comparison of `arranged` with the true positions
  double map_error = 1.0;                ///< shape difference of a map from a drive
  double wheels_error = 1.0;             ///< shape difference of the wheel odometry of the drive
  double map_rms_m = 0.0;                ///< error of the map, aligned and scaled to the true path
  double wheels_rms_m = 0.0;
};

/// Arranges the views of `office` without their poses and maps a drive through rooms of another
/// place. Adds a part to the page that animates the arrangement and draws the map.
DemoMaps demonstrate_maps(const VisualMemory& office, std::uint64_t seed, bool quick,
                          Session& session, viewer::ReportPage& page);

}  // namespace panonav::command
