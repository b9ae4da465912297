#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav {

/// A store of pictures that are not files of their own: those of a video, of a recording of topics.
class PictureStore {
 public:
  virtual ~PictureStore() = default;
  /// Reads the picture of this number. Several threads may call at a time; in ascending order it
  /// costs least. Throws FileError.
  [[nodiscard]] virtual Image read(std::size_t index) const = 0;
  /// Returns the recorded JPEG or PNG; nullopt if there is none.
  [[nodiscard]] virtual std::optional<std::vector<std::uint8_t>> encoded(
      std::size_t /*index*/) const {
    return std::nullopt;
  }
};

/// One picture of a data set with its stamp, poses and tilt.
struct DatasetEntry {
  std::string file;            ///< as the data set names it, relative to its folder; unique
  std::filesystem::path path;  ///< where it lies: its own file, or that of all pictures
  /// Time of the image, in seconds on the recording's clock.
  std::optional<double> stamp_s;
  std::optional<ReferencePose> pose;  ///< in the world frame
  std::optional<Pose2> odometry;      ///< in the odometry frame
  std::optional<Tilt> tilt;           ///< as an inertial sensor measured it
  /// Holds the picture; empty: `path` is the picture's own file.
  std::shared_ptr<const PictureStore> store;
  std::size_t store_index = 0;  ///< number of the picture in `store`
  friend bool operator==(const DatasetEntry&, const DatasetEntry&) = default;
};

/// Reads the image from its own file or from its store. Throws FileError.
[[nodiscard]] Image read_picture(const DatasetEntry& entry);
/// Reads the picture as a JPEG or PNG: the bytes of its own file, or those of its store; else a new
/// PNG.
[[nodiscard]] std::vector<std::uint8_t> read_encoded_picture(const DatasetEntry& entry);

/// A recording: pictures in order, and how they become panoramic cylinders. Pictures are read when
/// they are needed (PanoramaReader).
struct Dataset {
  /// Pictures of a recording that are read. Times are seconds from its first picture.
  struct Selection {
    int every = 1;  ///< each n-th of those that the times leave
    std::optional<double>
        every_s;  ///< the first, then the next one that is at least this much later
    std::optional<double> from_s;  ///< this moment included; empty: from the first
    std::optional<double> to_s;    ///< this moment included

    /// True if pictures need stamps to be selected.
    [[nodiscard]] bool by_time() const noexcept { return every_s || from_s || to_s; }
  };

  /// Fields that all pictures of a data set have.
  struct Fields {
    bool stamps = false;     ///< `stamp_s`
    bool positions = false;  ///< `pose`
    bool headings = false;   ///< of `pose`; true only with `positions`
    bool odometry = false;   ///< `odometry`
    bool tilts = false;      ///< `tilt`
  };

  std::filesystem::path folder;       ///< that `file` names are relative to
  PictureSource source;               ///< how all pictures lie
  std::vector<DatasetEntry> entries;  ///< in the order in which they were taken
  /// Of a folder of pictures: what lies in it and was left out, sorted; folders end in "/".
  std::vector<std::string> left_out;
  /// Warnings of the reader: what was left out, guessed or missing, a line each.
  std::vector<std::string> warnings;
};

/// Reads `folder`/dataset.toml and the table that it names (docs/formats.md). Throws FileError with
/// one line that names the file, the row or field, the value and what is allowed: wrong or missing
/// fields, numbers that are not finite, a name that stands twice, a picture that is not there, no
/// picture at all.
[[nodiscard]] Dataset read_dataset(const std::filesystem::path& folder);

/// Returns the indices of the pictures with these ascending stamps that are selected. A tenth of a
/// millisecond does not count.
[[nodiscard]] std::vector<std::size_t> choose_pictures(const std::vector<double>& stamps_s,
                                                       const Dataset::Selection& selection);

/// Keeps the selected entries. Throws FileError when the selection has times and an entry has no
/// stamp or one before that of its predecessor, and when nothing is left.
void select_pictures(Dataset& dataset, const Dataset::Selection& selection);

/// Reads a folder of PNG and JPEG pictures without dataset.toml, in natural order of their names
/// ("view_9" before "view_10"). Throws FileError when there is none.
[[nodiscard]] Dataset read_picture_folder(const std::filesystem::path& folder,
                                          PictureSource source);
/// Reads a folder with the images of all folders within ("morning/view_1"); links are not followed.
[[nodiscard]] Dataset read_picture_tree(const std::filesystem::path& folder, PictureSource source);

/// Makes a data set of one picture.
[[nodiscard]] Dataset read_single_picture(const std::filesystem::path& file, PictureSource source);

/// Returns the fields that all entries have; at least one entry.
[[nodiscard]] Dataset::Fields find_shared_fields(const Dataset& dataset);
/// Drops fields that only some entries have, so that `write_dataset` accepts them. Returns the
/// remaining ones.
Dataset::Fields drop_partial_fields(Dataset& dataset);

/// Writes dataset.toml, the table (poses.csv, or images.csv when no position is known) and, for
/// mirror pictures, camera.toml into `dataset.folder`; the pictures are the caller's. The table
/// comes before dataset.toml, so that a data set with a dataset.toml is whole. Only the columns
/// that every entry has can be written: throws ContractError when some entries have a value and
/// others have not.
void write_dataset(const Dataset& dataset);

}  // namespace panonav
