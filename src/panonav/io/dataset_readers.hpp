#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav {

/// What a caller says of an input, and which of its pictures are read.
struct InputOptions {
  /// Which topics of a recording become the data set. What is not named is found by its type.
  struct Topics {
    std::optional<std::string> image;     ///< sensor_msgs/Image or CompressedImage
    std::optional<std::string> odometry;  ///< nav_msgs/Odometry
    std::optional<std::string> imu;       ///< sensor_msgs/Imu
    /// Odometry from TF instead of a topic: the frame of the odometry, then that of the robot.
    std::optional<std::pair<std::string, std::string>> odometry_frames;
  };

  /// How its pictures lie. A folder with a dataset.toml says so itself and refuses it.
  std::optional<PictureSource> source;
  /// How they lie where neither `source` nor a dataset.toml says it, such as those of a memory.
  std::optional<PictureSource> default_source;
  Topics topics;                 ///< of a recording of topics; other inputs refuse them
  Dataset::Selection selection;  ///< which of its pictures
  bool recursive = false;        ///< of a folder: pictures of the folders within, too
};

/// How inputs of one kind are read.
struct DatasetReader {
  std::string name;         ///< the kind: "recording", "video"
  bool has_topics = false;  ///< whether `InputOptions::topics` applies
  /// Whether the path is of this kind. Never throws.
  bool (*recognises)(const std::filesystem::path& path) = nullptr;
  /// Reads what `options.selection` takes of it; the pictures lie as `source` says, whatever the
  /// options do. Throws FileError.
  Dataset (*read)(const std::filesystem::path& path, const PictureSource& source,
                  const InputOptions& options) = nullptr;
};

/// Adds a reader to the one table of the process, or replaces the one of its name. A program calls
/// it at its start for the kinds that it reads beside folders and single pictures; no kind is
/// registered by itself. Several threads may call. Throws ContractError on a reader without name or
/// functions.
void register_dataset_reader(const DatasetReader& reader);
/// Returns the first reader, in the order of registration, that recognises the path; `nullopt`
/// when none does.
[[nodiscard]] std::optional<DatasetReader> find_dataset_reader(const std::filesystem::path& path);
/// True if a reader of this name is registered.
[[nodiscard]] bool has_dataset_reader(const std::string& name);

}  // namespace panonav
