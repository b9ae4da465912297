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

/// The largest component of the map with its closures; where the recording knows positions, the map
/// is laid over them, and so is the odometry of its wheels.
[[nodiscard]] viewer::MapPlot draw_map(const Dataset& recording, const Mapper::Result& run);
/// Writes the map as a PNG or SVG file. Throws as `write_plot`.
void write_map_picture(const std::filesystem::path& path, const Dataset& recording,
                       const Mapper::Result& run);

/// Comparison of a map with the positions that the recording knows.
struct RecordedMapComparison {
  MapComparison positions;  ///< of the largest component; with a free scale unless wheels set it
  MapComparison::Closures closures;
  /// Shape difference of odometry alone, over the same nodes; nullopt if the recording has none.
  std::optional<double> odometry_shape_difference;
};
/// nullopt where fewer than three nodes have a position, or all are at one place.
[[nodiscard]] std::optional<RecordedMapComparison> compare_with_ground_truth(
    const Dataset& recording, const Mapper::Result& run);

/// Writes index.html: the drive, picture by picture on its map, and the map beside the truth where
/// it is known. Throws FileError.
void write_map_report(const std::filesystem::path& folder, const std::string& name,
                      const Dataset& recording, const Mapper::Result& run,
                      const viewer::RunPage& played);

}  // namespace panonav::command
