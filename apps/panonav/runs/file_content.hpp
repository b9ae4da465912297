#pragma once

#include <filesystem>
#include <string>

namespace panonav::command {

/// Kinds of files that verbs take, besides memories, recordings and what is named by its ending.
enum class FileContent {
  picture,      ///< PNG, JPEG, WebP, HEIC or AVIF
  toml,         ///< text with tables or keys of TOML
  calibration,  ///< calibration of a camera by another program, or another YAML file
  table,        ///< text whose first line is a row of numbers, or the head of a table
  world,        ///< SDF, as Gazebo's worlds
  mesh,         ///< COLLADA, OBJ, STL, glTF, PLY
  page,         ///< page that panonav wrote
  other         ///< nothing that a verb takes
};

/// Content of a file and what it looks like to a human.
struct IdentifiedContent {
  FileContent kind = FileContent::other;
  std::string description;  ///< "a GIF image"; of `other` with what to do, if there is a way
};

/// Identifies a file by its first bytes, and meshes also by the ending of the name. Throws
/// FileError if it cannot be read.
[[nodiscard]] IdentifiedContent identify_content(const std::filesystem::path& file);

}  // namespace panonav::command
