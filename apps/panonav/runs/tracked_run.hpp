#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/run_messages.hpp"
#include "panonav_recordings/run_recorder.hpp"
#include "panonav_viewer/page.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

/// One image of a run and the filter's estimate after it.
struct TrackedImage {
  std::size_t index = 0;  ///< in the data set, from 0
  std::string file;
  std::optional<double> stamp_s;
  std::optional<ReferencePose> truth;
  MonteCarloEstimate estimate;
  std::vector<Pose2> particles;  ///< an even sample of them, of the requested size
  std::optional<recordings::RunMoment>
      moment;  ///< what a record holds of it; nullopt: nothing is recorded
};

/// True if the robot was localised at the image.
[[nodiscard]] bool is_localised(const TrackedImage& image);
/// Error of the estimated pose; nullopt if it or the true pose is not known.
[[nodiscard]] std::optional<double> position_error_m(const TrackedImage& image);
[[nodiscard]] std::optional<double> heading_error_rad(const TrackedImage& image);

struct TrackSummary {
  std::size_t localised = 0;
  std::size_t ambiguous = 0;
  std::size_t lost = 0;
  std::optional<std::size_t> first_localised;  ///< images until then, that one included
  std::vector<double> errors_m;                ///< of localised images with a true position
  std::vector<double> heading_errors_rad;
};
/// Counts the next image, too.
void add(TrackSummary& summary, const TrackedImage& image);
[[nodiscard]] TrackSummary summarise_track(const std::vector<TrackedImage>& images);

struct TrackSettings {
  int every = 1;                   ///< pictures between those that are looked at, plus one
  std::size_t particles_kept = 0;  ///< of each image, for pictures and its page
  /// The memory's file, for the thumbnails of best matches: moments are filled. Null: they are not.
  const MemoryFile* recorded = nullptr;
  /// Which references the views are compared with, for moments; null: with none.
  const ShownReferences* shown = nullptr;
  /// Called before each image: returns true if a viewer has set the robot's pose. Empty: no viewer
  /// can.
  std::function<bool()> has_viewer_input;
};

/// Updates the filter with a view; completes the moment, if there is one.
[[nodiscard]] TrackedImage track_image(Tracker& tracker, const PackedSignature& view,
                                       const TrackSettings& settings,
                                       std::optional<recordings::RunMoment> moment);

/// Notes in the moment that a viewer has set the robot's pose.
void note_viewer_pose(recordings::RunMoment& moment);

/// Adds the image to the page that plays the run. Its moment must be there.
void add(viewer::RunPage& page, const TrackedImage& image);

/// Runs the filter over a recording whose entries all have odometry: it moves with every entry and
/// looks at every `settings.every`-th picture, the first one included. Signatures are computed on
/// all threads, the filter runs in order; the same on any number of threads. `report` is called
/// after each image, in order. Throws FileError on a picture that cannot be read.
void track(Tracker& tracker, const Dataset& run, const TrackSettings& settings, Executor& executor,
           const std::function<void(TrackedImage&&)>& report);

}  // namespace panonav::command
