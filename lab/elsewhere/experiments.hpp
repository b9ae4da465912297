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
  std::vector<RecordedGround> grounds{};  ///< compared by the next five experiments

  /// Returns the built-in scenes of the options and the worlds that exist in `options.data`.
  [[nodiscard]] std::vector<std::string> list_ground_names() const;
  void record_ground(const std::string& name);

  /// Measures how many own places are recognised, how many foreign places are mistaken for own
  /// ones, and how many positions are within the stated 95 % radius.
  void reproduce_known_places();
  /// Measures how often the place that an answer states with a probability is right, and how often
  /// an answer that is wrong names the true place as another possibility.
  void reproduce_stated_places();
  /// Measures the same of tracked poses on walks of which pieces were put into another order, so
  /// that the robot is kidnapped again and again.
  void reproduce_shuffled_walks();
  /// Memorises two variants of each built-in scene as floors of one building, in the same
  /// coordinates, and measures how often the floor is right.
  void reproduce_buildings();
  /// Measures how well the covariance of tracked poses that are reported as localised fits their
  /// errors.
  void reproduce_tracked_poses();
  /// Measures maps of drives by images alone and with wheels, and positions stated beside drives
  /// and routes.
  void reproduce_drives();
  /// Measures home vectors between two views of one ground, between views of two grounds, and
  /// between noise images.
  void reproduce_home_vectors();
  /// Measures homing runs of a robot that tilts.
  void reproduce_tilted_homing();
  /// Arranges views of a world on a grid of `spacing_m` by their similarity alone (without
  /// positions), and runs missions over this map.
  void reproduce_floor(const std::string& world, double spacing_m);
  /// Measures localisation in a place whose furniture and light change daily, with and without
  /// updates of the memory.
  void reproduce_days(const std::string& place);
  /// Merges the memories of two walks, both through one place or through different places.
  void reproduce_merging();
  /// Describes the images of recordings (folders of data sets) wrongly in three ways, mirrored,
  /// turned by 90 degrees and both, and counts how often their poses show it; also how often
  /// nothing is reported of the right descriptions.
  void reproduce_orientation(const std::vector<std::filesystem::path>& recordings);
  /// Localises each image of a recording (a data set's folder), rotated at random, in the memory of
  /// all other images: by panonav, the built-in rival methods and `rivals`.
  void reproduce_leave_one_out(const std::filesystem::path& recording,
                               std::vector<std::unique_ptr<RivalRecogniser>> rivals = {});
};

}  // namespace panonav::lab
