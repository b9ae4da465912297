#pragma once

#include <string>

#include "lab/experiments.hpp"

namespace panonav::lab {

/// The experiments of [Y03] and what its author left to later work.
struct RouteExperiments : Experiments {
  /// Section 5: drives across a straight path through `lab`, sweeps, time, the run to a goal;
  /// figures 3, 5, 9 and 10.
  void reproduce_lab_drives() const;
  /// 60 m repeated forward and back in closed loop through variants of `loop`, and how many bytes
  /// these routes take in a memory file.
  void reproduce_loop_routes() const;
  /// The same in a Gazebo world of `options.data`.
  void reproduce_world_routes(const std::string& name) const;
  /// A real route outdoors: `sussex_route` of `options.data`.
  void reproduce_real_route() const;
};

}  // namespace panonav::lab
