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

/// Experiments in scenes, worlds and recordings that were not used for development.
struct ElsewhereExperiments : Experiments {
  std::vector<RecordedGround> grounds{};  ///< that the next three experiments compare

  /// Returns the built-in scenes of the options and the worlds that exist in `options.data`.
  [[nodiscard]] std::vector<std::string> list_ground_names() const;
  void record_ground(const std::string& name);

  /// Measures recognised own places, foreign places recognised as own, and the 95 % radius.
  void reproduce_known_places();
  /// Measures the covariance of poses that tracking reports as localised.
  void reproduce_tracked_poses();
  /// Measures home vectors between views of one ground, of two, and between noise.
  void reproduce_home_vectors();
  /// Measures runs home of a robot that tilts.
  void reproduce_tilted_homing();
  /// Arranges views of a world on a grid of `spacing_m` by their similarity alone, and runs
  /// missions over the arrangement.
  void reproduce_floor(const std::string& world, double spacing_m);
  /// Localises in a place whose furniture and light change for days, with and without learning.
  void reproduce_days(const std::string& place);
  /// Merges the memories of two walks, through one place and through two places.
  void reproduce_merging();
  /// Localises each rotated image of a recording (the folder of a data set) in the memory of all
  /// others: by panonav, by the built-in rivals and by `rivals`.
  void reproduce_leave_one_out(const std::filesystem::path& recording,
                               std::vector<std::unique_ptr<RivalRecogniser>> rivals = {});
};

}  // namespace panonav::lab
