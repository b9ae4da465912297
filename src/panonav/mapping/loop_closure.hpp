#pragma once

#include <cstddef>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Conditions of a loop closure. Wrong closures are worse than missing ones, so a candidate must
/// pass every check.
struct LoopClosureOptions {
  int candidates = 5;  ///< for each view, from the memory's search
  /// Shortest loop: views nearer along the path are no candidates.
  double min_loop_m = 3.0;
  /// Largest share of the energy of both views that may be unexplained.
  double max_residual = 0.2;
  /// Largest distance between the views in units of R: farther ones are not reliable.
  double max_length = 0.3;
  /// Largest disagreement on the heading between the compass and the home vectors there and back.
  double heading_tolerance_rad = 0.15;
  /// Largest distance between start and end after both home vectors, in units of R.
  double return_tolerance = 0.1;
  /// Factor by which the residual of the best must be smaller than that of any other place: else
  /// the closure is ambiguous.
  double distinctness = 1.5;
  /// Rank within which the search from the candidate must find the present view.
  int reciprocal_rank = 5;
  /// Number of successive views whose closures must agree with the motion between them.
  int sequence = 3;
  /// Path length between reported closures: closer ones add nothing and cost time.
  double spacing_m = 0.5;
  /// Largest drift of the odometry, in metres for each metre since the last closure; a fifth of it
  /// along the rest of the loop, and one R in addition. The heading may be off by twice this, in
  /// rad, and `heading_tolerance_rad`.
  double max_drift = 0.1;
};
void visit_options(LoopClosureOptions& options, OptionVisitor& visitor);

/// Two nodes at the same place.
struct LoopClosure {
  std::size_t earlier = 0;   ///< index of a node
  std::size_t later = 0;     ///< index of a node after `earlier`
  Pose2 earlier_from_later;  ///< pose of the later node in the frame of the earlier one, metres
  double residual = 0.0;     ///< share of the energy of both views left unexplained
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

}  // namespace panonav
