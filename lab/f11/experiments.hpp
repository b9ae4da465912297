#pragma once

#include <filesystem>
#include <string>

#include "lab/experiments.hpp"
#include "panonav_simulation/mapping_run.hpp"

namespace panonav::lab {

/// The experiments of [F11] and what its authors left to later work.
struct MappingExperiments : Experiments {
  /// Figures 4 and 6 (a): 200 views 10 cm apart along the round trip of `loop`.
  void reproduce_first_set() const;
  /// Figures 5 and 6 (b): 150 views captured by threshold in `lab`.
  void reproduce_second_set() const;
  /// Time from a mirror image to a pose.
  void measure_step_time() const;
  /// Places that look alike: closures in a corridor of identical doors.
  void reproduce_identical_doors() const;
  /// 60 m with two loops in a Gazebo world of `options.data`.
  void reproduce_world(const std::string& name) const;
  /// The recordings of `options.data`: a route outdoors, a walk through a building.
  void reproduce_recordings() const;
  /// Time and memory at 100 views and at more, ten times each, up to `options.max_views`.
  void measure_large_maps() const;

  /// Variant `number` of a built-in scene.
  [[nodiscard]] simulation::PlaceRecording make_variant(const std::string& scene, int number) const;
};

}  // namespace panonav::lab
