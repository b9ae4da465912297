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

/// Which pictures of a recording a user wants.
struct PartArguments {
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::optional<std::string> every;  ///< "5": each fifth picture; "0.5s": one in half a second
};

/// The arguments for images without a dataset.toml.
struct PictureArguments {
  std::optional<std::string> kind;
  std::optional<std::string> camera;
  std::optional<std::string> columns;
  std::optional<double> forward_column;
  std::optional<std::pair<double, double>> elevation_deg;
  bool recursive = false;       ///< a folder of pictures: those of the folders within, too
  InputOptions::Topics topics;  ///< of a recording of topics
  PartArguments part;
};

/// Adds --kind, --camera, --columns-run, --forward-column and --elevation-deg.
void declare_layout(Arguments& arguments, PictureArguments& pictures);
/// Adds --image-topic, --odometry-topic, --odometry-frames and --imu-topic.
void declare_topics(Arguments& arguments, InputOptions::Topics& topics);
/// Adds --from and --to, and --every unless the verb has one of its own.
void declare_part(Arguments& arguments, PartArguments& part, bool every);
/// All three.
void declare_pictures(Arguments& arguments, PictureArguments& pictures);

/// Returns the flags of the last two, for verbs that also take single images.
[[nodiscard]] std::vector<std::string> recording_flags();
/// True if the input is neither a folder nor a recording, a video or a live source.
[[nodiscard]] bool is_one_picture(const std::string& input);

/// Returns the source of images that the flags describe; nullopt if none of them was given. Throws
/// UsageError on flags that do not fit together, FileError on the camera file.
[[nodiscard]] std::optional<PictureSource> picture_source(const PictureArguments& pictures);

/// Checks and converts the part. Throws UsageError on values out of range.
[[nodiscard]] Dataset::Selection to_selection(const PartArguments& part);

/// Opens the input as `open_input` with the options of the flags, and prints its warnings.
/// `remembered`: image layout of the memory, used for images without a description of their own.
/// Throws UsageError on flags that do not fit the input and on live sources except standard input,
/// which is read to its end; FileError.
[[nodiscard]] Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                                     const std::optional<PictureSource>& remembered,
                                     Session& session);
/// Throws UsageError on a band (--elevation-deg) that is not that of the memory's views.
void require_stored_band(const PictureArguments& pictures, const MemoryFile& memory);
/// Opens images for a memory: their layout is that of its header. Throws UsageError if
/// --elevation-deg differs from the memory's band.
[[nodiscard]] Dataset open_recording(const std::string& input, const PictureArguments& pictures,
                                     const MemoryFile& memory, Session& session);

/// The recording of a run: a data set, or a folder or recording of pictures that lie as those of
/// the memory.
[[nodiscard]] Dataset read_run(const std::string& input, const InputOptions::Topics& topics,
                               const PartArguments& part, const MemoryFile& memory,
                               Session& session);

/// Throws FileError unless the image's stamp is later than that of the image before it, as a
/// trajectory in the TUM format needs.
void require_later_stamp(const std::string& dataset, const std::string& file, double stamp_s,
                         double previous_s);

/// Returns the stamp of each entry for the trajectory file of a verb; the entries' numbers where
/// there are no stamps, which is noted. Throws FileError on stamps that do not grow.
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
/// Opens a data set as `open_recording`. Throws FileError on a folder without a table and says
/// which columns to add.
[[nodiscard]] Dataset read_dataset_with_columns(const std::string& folder,
                                                const PictureArguments& pictures,
                                                const std::optional<PictureSource>& remembered,
                                                const std::string& columns,
                                                const std::string& values, Session& session);

}  // namespace panonav::command
