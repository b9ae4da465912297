#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.hpp"
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
  std::vector<Pose2> particles;  ///< systematic sample of the particles
  std::optional<recordings::RunMoment>
      moment;  ///< for the record of the run; nullopt: not recorded
};

/// True if the robot was localised at the image.
[[nodiscard]] bool is_localised(const TrackedImage& image);
/// True if the image is localised, or its position is known but not its heading.
[[nodiscard]] bool is_position_known(const TrackedImage& image);
/// Returns the distance between estimated and true position; nullopt if one is unknown.
[[nodiscard]] std::optional<double> position_error_m(const TrackedImage& image);
[[nodiscard]] std::optional<double> heading_error_rad(const TrackedImage& image);

/// Returns the state in words.
[[nodiscard]] std::string format_state(LocalisationState state);

struct TrackSummary {
  std::size_t localised = 0;
  std::size_t position_known = 0;  ///< without a known heading
  std::size_t ambiguous = 0;
  std::size_t lost = 0;
  std::optional<std::size_t>
      first_localised;           ///< number of images up to and including the first localised one
  std::vector<double> errors_m;  ///< position errors of images whose position is known
  std::vector<double> heading_errors_rad;
};
/// Adds the next image to the summary.
void add(TrackSummary& summary, const TrackedImage& image);
/// Explains for people why the position was never known, and what to check; empty if it was.
[[nodiscard]] std::string explain_never_localised(const TrackSummary& summary,
                                                  const std::string& memory);
/// Says that the motion of a run of narrow images is not known, as its odometry is missing or in
/// metres where the memory's positions are not.
[[nodiscard]] std::string describe_unknown_motion(const std::string& run, const std::string& memory,
                                                  bool has_odometry);
[[nodiscard]] TrackSummary summarise_track(const std::vector<TrackedImage>& images);

struct TrackSettings {
  int every = 1;                        ///< the filter uses every n-th image
  std::size_t particles_per_image = 0;  ///< particles stored per image, for pictures and the page
  /// The memory's file, from which thumbnails of the best matches are read for moments. Null: no
  /// moments are made.
  const MemoryFile* thumbnail_file = nullptr;
  /// References with which moments compare the views; null: none.
  const ShownReferences* shown_references = nullptr;
  /// Called before each image; returns true if a viewer has set the robot's pose. Empty: viewers
  /// cannot set it.
  std::function<bool()> has_viewer_input;
};

/// Updates the filter with a view and completes the moment, if there is one.
[[nodiscard]] TrackedImage track_image(Tracker& tracker, const PackedSignature& view,
                                       const TrackSettings& settings,
                                       std::optional<recordings::RunMoment> moment);

/// Adds the event to the moment that a viewer has set the robot's pose.
void record_viewer_pose(recordings::RunMoment& moment);

/// Adds the image to the page that replays the run. `image.moment` must be set.
void add(viewer::RunPage& page, const TrackedImage& image);

/// Runs the filter over a recording, whose pauses of odometry are filled
/// (`Tracker::bridge_pauses`). Every entry is a motion step; every `settings.every`-th image, from
/// the first on, is an observation. Signatures are computed on all threads; results do not depend
/// on their number. `report` is called after each image, in order. An image that cannot be read is
/// skipped (`SkippedImages`).
void track(Tracker& tracker, const Dataset& run, const TrackSettings& settings, Session& session,
           const std::function<void(TrackedImage&&)>& report);

}  // namespace panonav::command
