#pragma once

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Differences of the views of one memory (`image_difference`): they decide whether a reference
/// shows the place of the robot.
struct PlaceScale {
  double neighbour_difference = 0.0;  ///< median between views with an edge
  double stranger_difference = 1.0;   ///< median between random views

  /// Largest difference between a view and the reference of its place: a robot between references
  /// is nearer to one of them than they are to each other.
  [[nodiscard]] double max_difference() const noexcept {
    return 0.5 * (neighbour_difference + stranger_difference);
  }
};

/// Learns the scale from at most `samples` pairs of each kind, evenly spread over the graph, by
/// their first components (0: all). Throws ContractError unless samples >= 1, and on views that the
/// source does not have. Cost: two comparisons for each sample, some 10 microseconds each.
[[nodiscard]] PlaceScale learn_place_scale(const ViewSource& source, const NavigationGraph& graph,
                                           int components = 0, int samples = 200);

/// When a robot has arrived at a place: half the spacing of the references around it, as the views
/// themselves show.
struct ArrivalScale {
  double max_difference = 0.08;  ///< by `image_difference`
  double max_length = 0.02;      ///< of the home vector, in units of R
  bool is_learnt = false;        ///< false: no edge of the place could be read
};

/// Takes half of the home vector and of the difference between the goal and the nearest references
/// around it (the median of the three shortest home vectors). The difference grows with the square
/// of the distance first and more slowly later, so half of it is reached at 0.7 of the spacing at
/// most; the home vector is the narrower test. Throws ContractError when the goal is not in the
/// graph.
[[nodiscard]] ArrivalScale learn_arrival_scale(const ViewSource& source,
                                               const NavigationGraph& graph, ViewId goal);

}  // namespace panonav
