#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lab/baselines/rivals.hpp"
#include "lab/experiments.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Variants of one kind of built-in scene, or one Gazebo world.
struct RecordedGround {
  std::string name;
  std::vector<simulation::PlaceRecording>
      variants;  ///< references on a grid, queries at random poses
};

/// How well all of it does on ground where it was not made.
struct ElsewhereExperiments : Experiments {
  std::vector<RecordedGround> grounds{};  ///< that the next three experiments compare

  /// All built-in scenes for robots on a floor; the worlds of `options.data` that are there.
  [[nodiscard]] std::vector<std::string> ground_names() const;
  void record_ground(const std::string& name);

  /// Own places known, places of other grounds taken for own, and the stated 95 % radius.
  void reproduce_known_places();
  /// The covariance of the poses that tracking calls localised, on walks as memorised.
  void reproduce_tracked_poses();
  /// Home vectors between views of one ground, of two, and between noise.
  void reproduce_home_vectors();
  /// Runs home of a robot that tilts.
  void reproduce_tilted_homing();
  /// The views of a world on a grid of `spacing_m`, arranged by their similarity alone, and
  /// missions over that.
  void reproduce_floor(const std::string& world, double spacing_m);
  /// A place whose furniture moves and whose light changes for days, asked of its memory with and
  /// without learning.
  void reproduce_days(const std::string& place);
  /// Memories of two walks each, through one place and through two, made into one.
  void reproduce_merging();
  /// A recording, a data set's folder: each picture, turned, is asked of the memory of all others,
  /// of panonav, of rivals that need no library, and of those that the caller has beside them.
  void reproduce_leave_one_out(const std::filesystem::path& recording,
                               std::vector<std::unique_ptr<RivalRecogniser>> rivals = {});
};

}  // namespace panonav::lab
