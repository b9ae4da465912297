#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// The largest component of the map with its closures; where the recording knows positions, the map
/// is laid over them, and so is the odometry of its wheels.
[[nodiscard]] viewer::MapPlot draw_map(const Dataset& recording, const Mapper::Result& run);
/// The same as a PNG or SVG file. Throws what `write_plot` throws.
void write_map_picture(const std::filesystem::path& path, const Dataset& recording,
                       const Mapper::Result& run);

/// Comparison of a map with the positions that the recording knows.
struct MapComparison {
  std::size_t compared = 0;       ///< nodes of the largest component with a true position
  double shape_difference = 0.0;  ///< mu [F11], 0 .. 1
  double rms_m = 0.0;  ///< after the best alignment; with a free scale where wheels tell none
  double scale = 1.0;  ///< of that alignment
  std::optional<double> trustworthiness;  ///< of 8 neighbours; empty where nodes are too few
  std::optional<double> continuity;
  std::size_t right_closures = 0;  ///< views at most 1 m apart
  std::size_t wrong_closures = 0;
  /// The same for odometry alone, over the same nodes; nullopt if the recording has none.
  std::optional<double> odometry_shape_difference;
};
/// Empty where fewer than three nodes have a position, or all are at one place.
[[nodiscard]] std::optional<MapComparison> compare_with_ground_truth(const Dataset& recording,
                                                                     const Mapper::Result& run);

/// Writes index.html: the drive, picture by picture on its map, and the map beside the truth where
/// it is known. Throws FileError.
void write_map_report(const std::filesystem::path& folder, const std::string& name,
                      const Dataset& recording, const Mapper::Result& run,
                      const viewer::RunPage& played);

}  // namespace panonav::command
