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

/// A store of pictures that have no files of their own, such as those of a video or a recording of
/// topics.
class PictureStore {
 public:
  virtual ~PictureStore() = default;
  /// Reads the picture of this number. Several threads may call at a time; reading in ascending
  /// order is fastest. Throws FileError.
  [[nodiscard]] virtual Image read(std::size_t index) const = 0;
  /// Returns the recorded JPEG or PNG file of a picture; nullopt if there is none.
  [[nodiscard]] virtual std::optional<std::vector<std::uint8_t>> encoded(
      std::size_t /*index*/) const {
    return std::nullopt;
  }
};

/// One picture of a data set with its stamp, poses and tilt.
struct DatasetEntry {
  /// Name relative to the data set's folder, with escapes (`escape_name`); unique.
  std::string file;
  std::filesystem::path path;  ///< its own file, or that of all pictures
  /// Time of the image, in seconds on the recording's clock.
  std::optional<double> stamp_s;
  std::optional<ReferencePose> pose;  ///< in the world frame
  std::optional<Pose2> odometry;      ///< in the odometry frame
  std::optional<Tilt> tilt;           ///< as an inertial sensor measured it
  /// Store that has the picture; null: the picture is the file `path`.
  std::shared_ptr<const PictureStore> store;
  std::size_t store_index = 0;  ///< number of the picture in `store`
  friend bool operator==(const DatasetEntry&, const DatasetEntry&) = default;
};

/// Reads the image from its own file or from its store. Throws FileError.
[[nodiscard]] Image read_picture(const DatasetEntry& entry);
/// Reads the same image in grey, of a JPEG file in less time (`read_grey_image`).
[[nodiscard]] Image read_grey_picture(const DatasetEntry& entry);
/// Returns the picture as JPEG or PNG: the bytes of its own file or of its store, otherwise a new
/// PNG.
[[nodiscard]] std::vector<std::uint8_t> read_encoded_picture(const DatasetEntry& entry);

/// A recording: pictures in order, and their layout, by which they become panoramas. Pictures are
/// read when they are needed (PanoramaReader).
struct Dataset {
  /// Selects the pictures of a recording that are used. Times are seconds from its first picture.
  struct Selection {
    int every = 1;                  ///< each n-th of those that the times select
    std::optional<double> every_s;  ///< seconds from one used picture to the next, at least
    std::optional<double> from_s;   ///< inclusive; nullopt: from the first
    std::optional<double> to_s;     ///< this moment included

    /// True if pictures need stamps to be selected.
    [[nodiscard]] bool has_time_selection() const noexcept { return every_s || from_s || to_s; }
  };

  /// Fields that pictures of a data set have: all (`find_shared_fields`) or some.
  struct Fields {
    bool stamps = false;     ///< `stamp_s`
    bool positions = false;  ///< `pose`
    bool headings = false;   ///< heading of `pose`; only with `positions`
    bool odometry = false;   ///< `odometry`
    bool tilts = false;      ///< `tilt`
  };

  std::filesystem::path folder;       ///< folder of the names `file`
  PictureSource source;               ///< layout of all pictures
  std::vector<DatasetEntry> entries;  ///< in the order in which they were taken
  /// Other files and folders (with final "/") in a folder of pictures, which were left out; sorted.
  std::vector<std::string> left_out;
  /// A picture that cannot be used.
  struct Unusable {
    std::string file;            ///< as in `entries`
    std::filesystem::path path;  ///< its file
    std::string fault;           ///< for people: value and what is allowed, without the file

    /// Returns the line for people, which begins with the file.
    [[nodiscard]] std::string describe() const;
  };
  std::vector<Unusable> unusable = {};  ///< taken out of `entries`, in order
  /// Warnings of the reader about things left out, guessed or missing, one line each.
  std::vector<std::string> warnings = {};
};

/// Reads `folder`/dataset.toml and the table that it names (docs/formats.md). Throws FileError with
/// one line that names file, row or field, value and what is allowed, if a field is wrong or
/// missing, a number is not finite, a name is repeated, a picture is missing, or there is none at
/// all. Positions, headings, odometry and tilts may be empty in some rows, with a warning.
[[nodiscard]] Dataset read_dataset(const std::filesystem::path& folder);

/// Returns the indices of the selected pictures, given the ascending stamps of all. Differences of
/// up to 0.1 ms are ignored.
[[nodiscard]] std::vector<std::size_t> select_picture_indices(const std::vector<double>& stamps_s,
                                                              const Dataset::Selection& selection);

/// Keeps the selected entries. Throws FileError if times are selected and an entry has no stamp or
/// a smaller one than the entry before, or if no entry is left.
void select_pictures(Dataset& dataset, const Dataset::Selection& selection);

/// Reads a folder of PNG and JPEG pictures (`is_folder_picture`) without dataset.toml, in natural
/// order of their names ("view_9" before "view_10"); with them those of other formats for which a
/// store is registered (`register_foreign_picture_store`). Throws FileError if it contains none.
[[nodiscard]] Dataset read_picture_folder(const std::filesystem::path& folder,
                                          PictureSource source);
/// Reads a folder with the images of all folders below it ("morning/view_1"); symbolic links are
/// not followed.
[[nodiscard]] Dataset read_picture_tree(const std::filesystem::path& folder, PictureSource source);

/// Makes a data set of one picture.
[[nodiscard]] Dataset read_single_picture(const std::filesystem::path& file, PictureSource source);

/// Throws FileError that names the first unusable picture if no entry is left.
void require_usable_entries(const Dataset& dataset);

/// Returns the fields that all entries have; needs at least one entry.
[[nodiscard]] Dataset::Fields find_shared_fields(const Dataset& dataset);
/// Returns the fields that some entries have, of which `write_dataset` writes columns; stamps only
/// if all have one. Needs at least one entry.
[[nodiscard]] Dataset::Fields find_known_fields(const Dataset& dataset);

/// Writes dataset.toml, the table (poses.csv, or images.csv if no position is known) and, for
/// mirror pictures, camera.toml into `dataset.folder`; the caller must write the pictures.
/// dataset.toml is written last, so that a data set that has one is complete. A field is empty in
/// the rows of entries that do not have it; stamps are only written if all have one. Throws
/// ContractError without entries.
void write_dataset(const Dataset& dataset);

}  // namespace panonav
