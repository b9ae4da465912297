#pragma once

#include "panonav/memory/view_source.hpp"
#include "panonav/navigation/navigation_graph.hpp"

namespace panonav {

/// How alike views of one memory look, by `image_difference`: what tells whether a reference shows
/// the place where the robot is.
struct PlaceScale {
  double neighbours = 0.0;  ///< median between views with an edge
  double strangers = 1.0;   ///< median between views at random

  /// A view that differs by more from the reference taken for its place was taken elsewhere: a
  /// robot between references is nearer to one of them than they are to each other.
  [[nodiscard]] double limit() const noexcept { return 0.5 * (neighbours + strangers); }
};

/// Learns it from at most `samples` pairs of each kind, evenly spread over the graph, compared by
/// their first components (0: all). Throws ContractError unless samples >= 1, and on views that the
/// source has not. Cost: two comparisons for each sample, some 10 microseconds each.
[[nodiscard]] PlaceScale learn_place_scale(const ViewSource& source, const NavigationGraph& graph,
                                           int components = 0, int samples = 200);

/// When a robot stands at a place: half the spacing of the references around it, as the views
/// themselves tell.
struct ArrivalScale {
  double difference = 0.08;  ///< most, by `image_difference`
  double length = 0.02;      ///< most of the home vector, in units of R
  bool learnt = false;       ///< false: no edge tells
};

/// Half of what home vector and difference are between the goal and the nearest references around
/// it (the median of the three shortest home vectors). The difference grows with the square of the
/// distance first and more slowly than the distance later, so half of it is reached at 0.7 of the
/// spacing at most; the home vector is the narrower test. Throws ContractError when the goal is not
/// in the graph.
[[nodiscard]] ArrivalScale learn_arrival_scale(const ViewSource& source,
                                               const NavigationGraph& graph, ViewId goal);

}  // namespace panonav
