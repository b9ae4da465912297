#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/relative_pose/orientation_evidence.hpp"
#include "panonav/storage/memory_file.hpp"

/// Checks of the stated orientation of images: the direction in which their columns run, and the
/// column or angle that is forward.
namespace panonav {

/// A setting of a data set or camera file and its value there.
struct OrientationSetting {
  std::string field;  ///< "columns", "direction", "forward_column" or "forward_angle_deg"
  std::string value;  ///< "clockwise", or a number
  friend bool operator==(const OrientationSetting&, const OrientationSetting&) = default;
};

/// Finding of poses or odometry about the stated orientation of images.
struct OrientationCheck {
  OrientationEvidence evidence;  ///< the compared pairs
  /// True, false, or nullopt if nothing can be said: `OrientationEvidence::runs_as_stated`.
  std::optional<bool> columns_right;
  std::optional<bool> forward_right;      ///< the same of the forward direction
  std::optional<OrientationFault> fault;  ///< what is wrong; nullopt: nothing that is shown
  /// Headings are those of the path, so the forward direction is the direction of motion.
  bool has_headings_of_path = false;
  /// The layout with its orientation corrected; nullopt without a fault, and for two fisheye
  /// lenses, which are calibrated again.
  std::optional<PictureSource> corrected;
  std::vector<OrientationSetting> settings;  ///< those that `corrected` changes
  /// The finding for people in one line, without `settings`; empty if nothing can be said.
  std::string explanation;
};

/// Checks the orientation of the images of a recording by poses with headings, odometry, or
/// positions with headings along the path, whichever most images have. Compares at most 60 images,
/// evenly spread, with up to three others each: the first of the next 100 that is 0.1 m away, the
/// first that turned by 10 degrees within 2 m, and the nearest image in another direction than the
/// first. Images that cannot be read are left out. Cost: that of reading at most 240 images and of
/// 180 home vectors, on all threads.
[[nodiscard]] OrientationCheck check_orientation(const Dataset& recording, Executor& executor);
/// The same with the views of a memory that have the names of the images, so that no image is read.
[[nodiscard]] OrientationCheck check_orientation(const Dataset& recording,
                                                 const MemoryFile& memory);
/// The same with the views of a memory and their own poses; finds nothing if these come from a map
/// of the images.
[[nodiscard]] OrientationCheck check_orientation(const MemoryFile& memory);
/// The same with true poses of the views that have nearly their stamps.
[[nodiscard]] OrientationCheck check_orientation(const MemoryFile& memory,
                                                 const TrajectoryFile& truth,
                                                 double max_stamp_difference_s);

/// Returns the source with its orientation corrected; nullopt for two fisheye lenses.
[[nodiscard]] std::optional<PictureSource> correct_orientation(PictureSource source,
                                                               const OrientationFault& fault);

/// Returns the line of a file: 'columns = "clockwise"'.
[[nodiscard]] std::string to_toml(const OrientationSetting& setting);
/// Returns the text of a dataset.toml with these fields of its section [images] replaced, or added
/// if they are missing; nullopt if it has no line "[images]".
[[nodiscard]] std::optional<std::string> replace_orientation(
    std::string_view dataset_toml, std::span<const OrientationSetting> settings);

/// Writes the corrected orientation completely or not at all: the camera file of a recording whose
/// images have a camera, or else its dataset.toml. Throws ContractError unless `check` has a
/// correction, and FileError, also if the recording has neither file.
void write_orientation(const std::filesystem::path& path, const Dataset& recording,
                       const OrientationCheck& check);

}  // namespace panonav
