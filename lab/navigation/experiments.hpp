#pragma once

#include <string>

#include "lab/experiments.hpp"

namespace panonav::lab {

/// Going somewhere over the memory. Each experiment appends rows and writes pictures into
/// `options.out`.
struct NavigationExperiments : Experiments {
  /// [M04] figure 18: missions in a built-in scene whose references lie on a grid of `spacing_m`
  /// and are arranged by their similarity alone.
  void reproduce_grid_missions(const std::string& scene, double spacing_m) const;
  /// Missions over maps of drives through a built-in scene, or a Gazebo world of `options.data`: as
  /// remembered, in other light and with objects moved, and with a robot that is kidnapped.
  void reproduce_drive_missions(const std::string& scene) const;
  /// Variants of `loop`: tours of five goals, among people too, and with all components of
  /// signatures compared at each step instead of the first few in the open.
  void reproduce_tours() const;
  /// Variants of `loop`: the same missions over the map of a drive with and without the route that
  /// was recorded on it.
  void reproduce_route_missions() const;
  /// Variants of `loop` with a way blocked that has a detour, and with two blocked so that there
  /// is none.
  void reproduce_blocked_missions() const;
};

}  // namespace panonav::lab
