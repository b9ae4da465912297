#pragma once

// The real recordings, read straight from their pictures and tables.

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "panonav/io/image_file.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/picture.hpp"
#include "support/skips.hpp"

namespace panonav::testing {

struct Recording {
  std::vector<std::string> files;
  std::vector<Panorama> views;
  std::vector<std::optional<ReferencePose>> poses;
};

inline Recording read_recording(const std::filesystem::path& folder, const std::string& table,
                                const PictureLayout& layout, PanoramaShape shape = {}) {
  Recording recording;
  std::ifstream stream(folder / table);
  std::string line;
  std::getline(stream, line);
  std::vector<std::string> names;
  std::stringstream header(line);
  for (std::string name; std::getline(header, name, ',');) names.push_back(name);
  while (std::getline(stream, line)) {
    std::stringstream cells(line);
    ReferencePose pose;
    bool posed = false;
    std::size_t column = 0;
    for (std::string cell; std::getline(cells, cell, ','); ++column) {
      if (names[column] == "file") recording.files.push_back(cell);
      if (names[column] == "x_m") pose.x_m = std::stod(cell), posed = true;
      if (names[column] == "y_m") pose.y_m = std::stod(cell);
      if (names[column] == "heading_deg") pose.heading_rad = radians(std::stod(cell));
    }
    const Image picture = read_image(folder / recording.files.back());
    recording.views.push_back(panorama_from_picture(picture.view(), layout, shape));
    recording.poses.push_back(posed ? std::optional(pose) : std::nullopt);
  }
  return recording;
}

/// `shape` 0 x 0 keeps the size of the pictures.
inline std::optional<Recording> gantry_plants(PanoramaShape shape = {}) {
  const auto folder = real_data("gantry_plants");
  if (!folder) return std::nullopt;
  return read_recording(*folder, "poses.csv", {.direction = ColumnDirection::clockwise}, shape);
}

inline std::optional<Recording> sussex_route(PanoramaShape shape = {}) {
  const auto folder = real_data("sussex_route");
  if (!folder) return std::nullopt;
  return read_recording(*folder, "poses.csv", {.direction = ColumnDirection::counter_clockwise},
                        shape);
}

inline std::optional<Recording> indoor_walk(PanoramaShape shape) {
  const auto folder = real_data("indoor_walk_360");
  if (!folder) return std::nullopt;
  return read_recording(*folder, "images.csv",
                        {.direction = ColumnDirection::clockwise,
                         .elevations = ElevationBand{radians(-90.0), radians(90.0)},
                         .kept_elevations = ElevationBand{radians(-30.0), radians(40.0)}},
                        shape);
}

/// Panoramas of rooms, 1.2 to 2.2 m apart.
inline std::optional<Recording> sparse_rooms(PanoramaShape shape) {
  const auto folder = real_data("ciirc_b670");
  if (!folder) return std::nullopt;
  return read_recording(*folder, "poses.csv",
                        {.direction = ColumnDirection::clockwise,
                         .elevations = ElevationBand{radians(-90.0), radians(90.0)},
                         .kept_elevations = ElevationBand{radians(-30.0), radians(40.0)}},
                        shape);
}

/// The number at the end of a file name, before its extension; -1 when there is none.
inline int trailing_number(const std::string& file) {
  const std::string stem = std::filesystem::path(file).stem().string();
  std::size_t begin = stem.size();
  while (begin > 0 && stem[begin - 1] >= '0' && stem[begin - 1] <= '9') --begin;
  return begin == stem.size() ? -1 : std::stoi(stem.substr(begin));
}

}  // namespace panonav::testing
