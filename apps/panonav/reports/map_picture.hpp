#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "cli/arguments.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::command {

/// Files for the map that a verb makes.
struct MapFileArguments {
  std::optional<std::string> tum;
  std::optional<std::string> graph;
  std::optional<std::string> picture;
};

/// Adds --tum, --graphml and --picture.
void declare_map_files(Arguments& arguments, MapFileArguments& files);

/// Draws the largest component of the map with its closures. If the recording has true positions,
/// map and wheel odometry are aligned with them.
[[nodiscard]] viewer::MapPlot draw_map(const Dataset& recording, const Mapper::Result& run);
/// Writes the map as a PNG or SVG file. Throws like `write_plot`.
void write_map_picture(const std::filesystem::path& path, const Dataset& recording,
                       const Mapper::Result& run);

/// Comparison of a map with the true positions of the recording.
struct RecordedMapComparison {
  MapComparison positions;  ///< largest component; free scale unless wheels give lengths
  MapComparison::Closures closures;
  /// Shape difference of odometry alone, over the same nodes; nullopt if the recording has none.
  std::optional<double> odometry_shape_difference;
};
/// Returns nullopt if there are fewer than three nodes, a node has no true position, or all are at
/// one point.
[[nodiscard]] std::optional<RecordedMapComparison> compare_with_ground_truth(
    const Dataset& recording, const Mapper::Result& run);

/// Writes index.html with a replay of the drive on its map, and with the map and the true path if
/// it is known. Throws FileError.
void write_map_report(const std::filesystem::path& folder, const std::string& name,
                      const Dataset& recording, const Mapper::Result& run,
                      const viewer::RunPage& replay_page);

}  // namespace panonav::command
