#pragma once

#include <cstddef>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Conditions of a loop closure. Wrong closures are worse than missing ones, so a candidate must
/// pass every check.
struct LoopClosureOptions {
  int candidates = 5;  ///< number of candidates for each view, from the memory's search
  /// Shortest path length of a loop; views that are closer along the path are no candidates.
  double min_loop_m = 3.0;
  /// Largest share of the energy of both views that may be unexplained. Of 177 closures in seven
  /// drives, those up to 0.06 were off by 0.02 m (90 %: 0.09 m), those above 0.12 by 0.7 m (1.8 m).
  double max_residual = 0.1;
  /// Largest distance between the views in units of R, the distance of the things around; home
  /// vectors between farther views are not reliable.
  double max_length = 0.3;
  /// Largest heading difference between compass and home vector, and between the home vectors in
  /// both directions.
  double heading_tolerance_rad = 0.15;
  /// Largest length of the sum of the home vectors there and back, in units of R; 0 if each is the
  /// inverse of the other.
  double return_tolerance = 0.1;
  /// Smallest ratio of the residual at any other place to that at the best place; below it the
  /// closure is ambiguous.
  double distinctness = 1.5;
  /// Number of best matches of the candidate among which the present view must be.
  int reciprocal_rank = 5;
  /// Number of successive views whose closures must agree with the motion between them.
  int sequence = 3;
  /// Shortest path between reported closures: closer ones cost time and add no information.
  double spacing_m = 0.5;
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
