#pragma once

#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/dataset_readers.hpp"
#include "panonav/io/trajectory_file.hpp"
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
  /// True for verbs that take narrow pictures (--kind pinhole).
  bool takes_narrow = false;
  std::optional<double> field_of_view_deg;
  bool recursive = false;     ///< also reads images in the subfolders of a folder
  bool ignore_gpano = false;  ///< does not level images by their GPano data
  /// How unusable images of a folder are found before the verb begins.
  enum class Check {
    pixels,  ///< all are decoded
    heads,   ///< the verb skips images whose pixels are damaged as it reads them (`SkippedImages`)
    none     ///< the verb skips and lists all of them as it reads them
  };
  Check check = Check::pixels;
  InputOptions::Topics topics;  ///< for a recording with topics
  PartArguments part;
  std::vector<std::string> further_videos;  ///< that continue the input, a video
};

/// The arguments for the recording of a run, whose layout the memory gives.
struct RunArguments {
  InputOptions::Topics topics;
  PartArguments part;
  bool ignore_gpano = false;
  std::vector<std::string> further_videos;  ///< as in `PictureArguments`
};

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

/// Prints how many images of a recording are skipped, and why the first ones are; nothing if none
/// is.
void note_unusable(const Dataset& recording, Session& session);

/// Images of a run that are skipped because they cannot be read.
class SkippedImages {
 public:
  /// `image_count`: number of images that the run reads.
  SkippedImages(std::size_t image_count, Session& session)
      : image_count_(image_count), session_(session) {}
  /// Prints why an image is skipped. Rethrows errors that do not concern an image, and the error of
  /// the last image if all were skipped.
  void add(const std::exception_ptr& failure);

 private:
  std::size_t image_count_;
  std::size_t skipped_count_ = 0;
  Session& session_;
};

/// Prints a note if the images of `input` are of a camera with another model than that of the
/// reference images, with the elevations that both show.
void note_other_camera(const PictureSource& images, const PictureSource& reference,
                       const std::string& input, Session& session);

/// The option with which a verb uses another elevation band.
inline constexpr const char* elevation_flag = "--elevation-deg LOW HIGH";
/// Prints a note if the images are equirectangular and no elevation band is stated for them. `way`:
/// how to state one.
void note_default_band(const PictureSource& source, const std::string& way, Session& session);

/// Converts the arguments to a selection of images. Throws UsageError on values out of range.
[[nodiscard]] Dataset::Selection to_selection(const PartArguments& part);

/// Opens the input with `open_input` and the options of the flags, and prints its warnings.
/// `remembered` is the image layout of the memory, used for images without a description of their
/// own; without it, prints a note on a default elevation band. Images of a folder or data set that
/// cannot be used are left out, and a note names the first. Standard input is read to its end.
/// Throws UsageError on flags that do not apply to the input and on other live sources; FileError.
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
[[nodiscard]] Dataset open_run(const std::string& input, const RunArguments& run,
                               const MemoryFile& memory, Session& session);

/// True if the positions of the memory are those of its map, whose frame is not that of the poses
/// of a run, so that their distances are no errors. The session prints a note if the run has poses.
[[nodiscard]] bool has_incomparable_truth(const Dataset& run, const std::string& input,
                                          const MemoryFile& memory, Session& session);

/// Adds a pose to a trajectory for a file. Leaves it out if it has the stamp of the last one.
/// Throws FileError on an earlier stamp, which the TUM format does not allow; `file`: the image.
void append_pose(std::vector<StampedPose>& trajectory, const StampedPose& pose,
                 const std::string& dataset, const std::string& file);

/// Returns the stamp of each entry in seconds for a trajectory file. Unless all entries have
/// stamps, they get their index; the session prints a note on this, and on stamps that repeat.
/// Throws FileError if stamps decrease.
[[nodiscard]] std::vector<double> trajectory_stamps(const Dataset& run, const std::string& verb,
                                                    const std::string& dataset,
                                                    const std::string& tum, Session& session);
/// Returns the units of a trajectory with the stamps of `trajectory_stamps`.
[[nodiscard]] TrajectoryUnits find_trajectory_units(const Dataset& run, LengthUnit lengths);

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
