#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/dataset_readers.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// Selects a part of the images of a recording.
struct PartArguments {
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::optional<std::string> every;  ///< "5": each fifth image; "0.5s": one per half second
};

/// The arguments for images without a dataset.toml.
struct PictureArguments {
  std::optional<std::string> kind;
  std::optional<std::string> camera;
  std::optional<std::string> columns;
  std::optional<double> forward_column;
  std::optional<std::pair<double, double>> elevation_deg;
  bool recursive = false;       ///< also reads images in the subfolders of a folder
  InputOptions::Topics topics;  ///< for a recording with topics
  PartArguments part;
};

/// Adds --kind, --camera, --columns-run, --forward-column and --elevation-deg.
void declare_picture_layout(Arguments& arguments, PictureArguments& pictures);
/// Adds --image-topic, --odometry-topic, --odometry-frames and --imu-topic.
void declare_topics(Arguments& arguments, InputOptions::Topics& topics);
/// Adds --from and --to, with `every` also --every.
void declare_part(Arguments& arguments, PartArguments& part, bool every);
/// Adds the flags of `declare_picture_layout`, `declare_topics` and `declare_part`.
void declare_pictures(Arguments& arguments, PictureArguments& pictures);

/// Returns the flags of `declare_topics` and `declare_part`, which verbs reject for single images.
[[nodiscard]] std::vector<std::string> recording_flags();
/// True if the input is not a folder, recording, video or live source.
[[nodiscard]] bool is_one_picture(const std::string& input);

/// Returns the image layout that the flags describe; nullopt if none of them is set. Throws
/// UsageError on flags that exclude each other, FileError on an invalid camera file.
[[nodiscard]] std::optional<PictureSource> make_picture_source(const PictureArguments& pictures);

/// Converts the arguments to a selection of images. Throws UsageError on values out of range.
[[nodiscard]] Dataset::Selection to_selection(const PartArguments& part);

/// Opens the input with `open_input` and the options of the flags, and prints its warnings.
/// `remembered` is the image layout of the memory, used for images without a description of their
/// own. Standard input is read to its end. Throws UsageError on flags that do not apply to the
/// input and on other live sources; FileError.
[[nodiscard]] Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                                     const std::optional<PictureSource>& remembered,
                                     Session& session);
/// Throws UsageError if --elevation-deg differs from the elevation band of the memory's views.
void require_stored_band(const PictureArguments& pictures, const MemoryFile& memory);
/// Opens images for a memory. Images without a description have the layout of the memory's header.
/// Throws UsageError if --elevation-deg differs from the memory's band.
[[nodiscard]] Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                                     const MemoryFile& memory, Session& session);

/// Opens the recording of a run: a data set, folder or recording. Images without a description have
/// the layout of the memory's images.
[[nodiscard]] Dataset open_run(const std::string& input, const InputOptions::Topics& topics,
                               const PartArguments& part, const MemoryFile& memory,
                               Session& session);

/// Throws FileError unless the stamp is later than `previous_s`, the stamp of the image before, as
/// the TUM format requires.
void require_later_stamp(const std::string& dataset, const std::string& file, double stamp_s,
                         double previous_s);

/// Returns the stamp of each entry in seconds for a trajectory file. Entries without stamps get
/// their index, and the session prints a note. Throws FileError if stamps do not increase.
[[nodiscard]] std::vector<double> trajectory_stamps(const Dataset& run, const std::string& verb,
                                                    const std::string& dataset,
                                                    const std::string& tum, Session& session);

/// True for data sets and folders of images, whose poses a table gives; false for recordings of
/// topics and videos.
[[nodiscard]] bool can_have_table(const std::string& input);
/// Explains how to add columns to a data set or folder of images, for the end of an error message:
/// the table of a data set gets them, a folder of images needs a dataset.toml first. `values`: an
/// example of a line.
[[nodiscard]] std::string explain_columns(const std::string& folder, const std::string& columns,
                                          const std::string& values);
/// Opens a data set with `open_recording`. Throws FileError on a folder without dataset.toml; the
/// message explains which columns to add.
[[nodiscard]] Dataset read_dataset_with_columns(const std::string& folder,
                                                const PictureArguments& pictures,
                                                const std::optional<PictureSource>& remembered,
                                                const std::string& columns,
                                                const std::string& values, Session& session);

}  // namespace panonav::command
