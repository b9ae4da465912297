#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/io/dataset.hpp"

namespace panonav {

/// Layout of an input, as stated by the caller, and which of its pictures are read.
struct InputOptions {
  /// Topics of a recording to read; those that are not named are found by type.
  struct Topics {
    std::optional<std::string> image;     ///< sensor_msgs/Image or CompressedImage
    std::optional<std::string> odometry;  ///< nav_msgs/Odometry
    std::optional<std::string> imu;       ///< sensor_msgs/Imu
    /// Frames of odometry and robot, if TF instead of a topic gives the odometry.
    std::optional<std::pair<std::string, std::string>> odometry_frames;
  };

  /// Layout of the pictures. Must be empty for a folder with a dataset.toml, which has its own.
  std::optional<PictureSource> source;
  /// Layout to use if neither `source` nor a dataset.toml states one, such as that of a memory.
  std::optional<PictureSource> default_source;
  Topics topics;                 ///< of a recording of topics; other inputs refuse them
  Dataset::Selection selection;  ///< which of its pictures
  bool recursive = false;        ///< folders: also read those within
  /// Videos that continue a video, such as its chapters; other inputs refuse them.
  std::vector<std::filesystem::path> further_videos = {};
  /// Read pictures as if they had no GPano data (`apply_gpano`), as those whose makers levelled
  /// them already.
  bool ignore_gpano = false;
};

/// A reader of inputs of one kind.
struct DatasetReader {
  std::string name;         ///< the kind: "recording", "video"
  bool has_topics = false;  ///< whether `InputOptions::topics` applies
  /// Returns true if the path is of this kind. Never throws.
  bool (*recognises)(const std::filesystem::path& path) = nullptr;
  /// Reads the pictures that `options.selection` selects; `source` is their layout and replaces
  /// that of `options`. Throws FileError.
  Dataset (*read)(const std::filesystem::path& path, const PictureSource& source,
                  const InputOptions& options) = nullptr;
};

/// Adds a reader to the table of the process, or replaces the reader with the same name. Programs
/// call it at their start for each kind that they read in addition to folders and single pictures;
/// no kind is registered by default. Several threads may call. Throws ContractError if the name or
/// a function is missing.
void register_dataset_reader(const DatasetReader& reader);
/// Returns the reader registered first among those that recognise the path; `nullopt` if there is
/// none.
[[nodiscard]] std::optional<DatasetReader> find_dataset_reader(const std::filesystem::path& path);
/// Makes a store whose picture i is the file `files[i]`, of the kind
/// `MediaKind::foreign_picture`.
using ForeignPictureStoreMaker =
    std::shared_ptr<const PictureStore> (*)(std::vector<std::filesystem::path> files);
/// Sets how pictures are read that are neither PNG nor JPEG, in folders and in tables of data sets;
/// without it, they are left out of folders. Several threads may call.
void register_foreign_picture_store(ForeignPictureStoreMaker maker);
/// True if a maker of such stores is registered.
[[nodiscard]] bool can_read_foreign_pictures();
/// Sets the stores of the entries whose files are foreign pictures, if a maker is registered.
void set_foreign_picture_stores(std::vector<DatasetEntry>& entries);

/// True if a reader of this name is registered.
[[nodiscard]] bool has_dataset_reader(const std::string& name);

}  // namespace panonav
