#pragma once

#include <cstddef>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Conditions of a loop closure. Wrong closures are worse than missing ones, so a candidate must
/// pass every check.
struct LoopClosureOptions {
  /// Candidates for each view, from the memory's search.
  int candidates = 5;
  /// Views nearer than this along the path are no candidates: there is no loop to close.
  double min_loop_m = 3.0;
  /// The view explains the candidate up to this share of the energy of both.
  double max_residual = 0.2;
  /// Farther apart, in units of R, the views are not reliable.
  double max_length = 0.3;
  /// Largest disagreement on the heading between the compass and the home vectors there and back.
  double heading_tolerance_rad = 0.15;
  /// Largest distance between start and end after both home vectors, in units of R.
  double return_tolerance = 0.1;
  /// Another place that explains the view nearly as well makes it ambiguous: the residual of the
  /// best must be smaller by this factor.
  double distinctness = 1.5;
  /// The search from the candidate must lead back to here among so many views.
  int reciprocal_rank = 5;
  /// This many successive views must have closures that agree with the motion between them.
  int sequence = 3;
  /// Distance along the path between reported closures: closer ones add nothing and cost time.
  double spacing_m = 0.5;
  /// Drift of the odometry, in metres for each metre, beyond which no closure is believed: counted
  /// from the last closure, and a fifth of it along the rest of the loop. One R comes on top. The
  /// heading may be off by twice this, in rad, and `heading_tolerance_rad`.
  double max_drift = 0.1;
};
void visit_options(LoopClosureOptions& options, OptionVisitor& visitor);

/// Two nodes that see the same place.
struct LoopClosure {
  std::size_t earlier = 0;   ///< place among the nodes given
  std::size_t later = 0;     ///< place among the nodes given, after `earlier`
  Pose2 earlier_from_later;  ///< pose of the later node in the frame of the earlier one, metres
  double residual = 0.0;     ///< share of the energy of both views left unexplained
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

}  // namespace panonav
