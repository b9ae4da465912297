#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/picture_guess.hpp"

namespace panonav::command {

/// A trial of a user's own images: all are memorised, and each is localised among the others.
struct Trial {
  /// An image, and the place that was found for it among the other images.
  struct Query {
    std::string name;
    Place place;
  };

  std::vector<std::string> inputs;  ///< as the user typed them; several videos are one
  PictureGuess guess;
  std::size_t image_count = 0;      ///< of the input
  std::vector<std::string> unread;  ///< images that cannot be read or have another size
  std::vector<Query> queries;       ///< the images that were tried, in their order
  std::optional<Lean> lean;         ///< of the camera; nullopt: not measured or not significant
  /// Elevation up to which the images show the camera's carrier; these rows are left out.
  std::optional<double> carrier_top_rad;
  double mean_brightness = 0.0;          ///< 0 .. 1
  std::optional<Image> example;          ///< an unwrapped image
  std::filesystem::path memory;          ///< the memory file
  std::optional<TopologicalMap> map;     ///< of the memory; nullopt: all parts are too small
  std::optional<MemoryMap> map_summary;  ///< description of `map`
  bool has_positions = false;            ///< of a data set, so that there is no map
  bool is_in_order = false;              ///< `are_in_order`
  /// Median distance between two images if things around are 1.5 m away (`VisualOdometryOptions`);
  /// nullopt: most pairs of images do not show the motion between them.
  std::optional<double> median_distance_m;
  /// Median distance between consecutive positions of a data set.
  std::optional<double> median_step_m;
  /// Median distance of these positions from the nearest other one.
  std::optional<double> median_nearest_m;
  /// Number of images at which tracking knows the position; nullopt: there are no positions.
  std::optional<std::size_t> tracked;
  std::vector<Pose2> map_poses;                 ///< of the map's nodes, parts beside each other
  std::optional<std::filesystem::path> camera;  ///< file of a camera that was found

  [[nodiscard]] std::size_t count_known() const;
  /// True if two images are typically nearer to each other than the shortest step of a good
  /// recording, so that the whole recording shows one place.
  [[nodiscard]] bool is_standing() const;
  /// True if nine of ten images or more are in one part of the map, as `find_drive_poses` needs.
  [[nodiscard]] bool has_large_part() const {
    return map && map_summary && 10 * map_summary->part_sizes.front() >= 9 * queries.size();
  }
  /// True if the images are in no order and were arranged by their similarity.
  [[nodiscard]] bool is_arranged() const {
    return !has_positions && !is_in_order && has_large_part();
  }
  /// True if there is a map that means something, of images in order or arranged ones.
  [[nodiscard]] bool has_map() const {
    return map && map_summary && (is_in_order || is_arranged());
  }
  /// True if tracking knows the position at half of the images or more.
  [[nodiscard]] bool can_track() const { return tracked && 2 * *tracked >= queries.size(); }
  /// Number of steps between consecutive images whose motion is visible.
  [[nodiscard]] std::size_t count_connected_steps() const;
};

/// Returns the file name of the memory for an input: that of the folder or video.
[[nodiscard]] std::string choose_memory_name(const std::string& input);

/// Opens the input (of several, videos that continue the first), guesses how to read its images,
/// memorises at most 400 of them at equal intervals in `folder`, and localises each one among the
/// others. Throws FileError.
[[nodiscard]] Trial run_trial(const std::vector<std::string>& inputs,
                              const std::filesystem::path& folder, Session& session);

/// The result of a trial in words.
struct TrialVerdict {
  bool is_good = false;               ///< at least nine of ten images and steps are recognised
  std::string headline;               ///< one line
  std::vector<std::string> findings;  ///< a sentence each, the most important one first
  std::vector<std::string> commands;  ///< command lines to continue with
};
[[nodiscard]] TrialVerdict judge_trial(const Trial& trial);

}  // namespace panonav::command
