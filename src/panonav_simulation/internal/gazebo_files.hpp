#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav_simulation/internal/xml.hpp"

namespace panonav::simulation {

/// Throws FileError unless `file` is a regular file of at most 256 MB. Worlds and meshes name other
/// files, which could be devices or pipes without an end.
void require_scene_file(const std::filesystem::path& file);

/// Reads the bytes of a file. Throws FileError as require_scene_file does.
[[nodiscard]] std::string read_scene_file(const std::filesystem::path& file);

/// True if two texts differ at most in the case of their ASCII letters.
[[nodiscard]] bool equals_ignoring_case(std::string_view a, std::string_view b);

struct FoundFile {
  std::filesystem::path path;
  bool as_written = true;  ///< false: differs in the case of letters
};

/// Finds and reads the files that a Gazebo world refers to.
class GazeboFiles {
 public:
  GazeboFiles(std::filesystem::path world, std::vector<std::filesystem::path> model_folders);

  /// Finds the file or folder that `uri` refers to: `model://` and `package://` in the model
  /// folders, models of a Fuel server (`https://.../models/NAME`) as `model://NAME`, and `file://`
  /// and plain paths as absolute paths, relative to `directory` or the world, or in the model
  /// folders. If no name matches exactly, a name that differs in case is used. nullopt if there is
  /// none.
  [[nodiscard]] std::optional<FoundFile> resolve(std::string_view uri,
                                                 const std::filesystem::path& directory) const;

  /// Returns the model folders as text for messages.
  [[nodiscard]] std::string list_folders() const;

  /// Returns the root element <sdf> or <gazebo> of a file, which is read once; valid as long as
  /// this object. Throws FileError.
  pugi::xml_node read_sdf_root(const std::filesystem::path& file);

  /// Finds the model description in a folder: the one of the highest version in `model.config` or
  /// `manifest.xml`, else `model.sdf`, else the first *.sdf file. Throws FileError.
  [[nodiscard]] static std::filesystem::path find_description(const std::filesystem::path& folder);

 private:
  std::filesystem::path world_;
  std::vector<std::filesystem::path> folders_;
  std::map<std::string, pugi::xml_document> files_;
};

}  // namespace panonav::simulation
