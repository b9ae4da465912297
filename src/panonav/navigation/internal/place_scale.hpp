#pragma once

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// Typical differences (`image_difference`) between views of one memory, which determine the
/// threshold at which a reference matches the robot's place.
struct PlaceScale {
  double neighbour_difference = 0.0;     ///< median between views with an edge
  double distant_pair_difference = 1.0;  ///< median between views half the graph apart

  /// Largest difference between a view and the reference of its place: the mean of the two medians.
  /// A robot between references is nearer to one of them than they are to each other.
  [[nodiscard]] double max_difference() const noexcept {
    return 0.5 * (neighbour_difference + distant_pair_difference);
  }
};

/// Learns the scale from at most `samples` pairs of each kind, spread evenly over the graph.
/// Compares their first `components` (0: all). Throws ContractError unless samples >= 1, and on
/// views that the source does not have. Cost: two comparisons for each sample, some 10 microseconds
/// each.
[[nodiscard]] PlaceScale learn_place_scale(const ViewSource& source, const NavigationGraph& graph,
                                           int components = 0, int samples = 200);

/// Thresholds of arrival at a place: about half the spacing of the references around it, measured
/// by the views themselves.
struct ArrivalScale {
  double max_difference = 0.08;  ///< by `image_difference`
  double max_length = 0.02;      ///< of the home vector, in units of R
  bool is_learnt = false;        ///< false: no edge of the place could be read
};

/// Returns half of the home vector's length and half of the difference between the goal and a
/// reference next to it (the median of the three shortest home vectors). The difference grows first
/// with the square of distance and later more slowly, so half of it is reached at no more than
/// 0.7 of the spacing; the home vector is the stricter test. Throws ContractError when the goal is
/// not in the graph.
[[nodiscard]] ArrivalScale learn_arrival_scale(const ViewSource& source,
                                               const NavigationGraph& graph, ViewId goal);

}  // namespace panonav
