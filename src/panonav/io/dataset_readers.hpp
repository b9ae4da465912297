#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav {

/// Layout of an input as a caller states it, and which of its pictures are read.
struct InputOptions {
  /// Topics of a recording that become the data set; those that are not named are found by type.
  struct Topics {
    std::optional<std::string> image;     ///< sensor_msgs/Image or CompressedImage
    std::optional<std::string> odometry;  ///< nav_msgs/Odometry
    std::optional<std::string> imu;       ///< sensor_msgs/Imu
    /// Odometry from TF instead of a topic: the frame of the odometry, then that of the robot.
    std::optional<std::pair<std::string, std::string>> odometry_frames;
  };

  /// Layout of its pictures. A folder with a dataset.toml states its own and refuses it.
  std::optional<PictureSource> source;
  /// Layout where neither `source` nor a dataset.toml states one, such as that of a memory.
  std::optional<PictureSource> default_source;
  Topics topics;                 ///< of a recording of topics; other inputs refuse them
  Dataset::Selection selection;  ///< which of its pictures
  bool recursive = false;        ///< of a folder: pictures of the folders within, too
};

/// A reader of inputs of one kind.
struct DatasetReader {
  std::string name;         ///< the kind: "recording", "video"
  bool has_topics = false;  ///< whether `InputOptions::topics` applies
  /// True if the path is of this kind. Never throws.
  bool (*recognises)(const std::filesystem::path& path) = nullptr;
  /// Reads the pictures that `options.selection` selects; `source` is their layout, whatever the
  /// options state. Throws FileError.
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
