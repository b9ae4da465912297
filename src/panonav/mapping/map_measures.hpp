#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>

#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/topological_map.hpp"

namespace panonav {

/// Agreement of a map's positions with the true ones.
struct MapComparison {
  /// Quality of a map by the neighbourhoods it preserves (Venna and Kaski 2001); 1 is perfect,
  /// chance gives about 0.5.
  struct Neighbours {
    double trustworthiness = 1.0;  ///< neighbours in the map are neighbours in truth
    double continuity = 1.0;       ///< neighbours in truth are neighbours in the map
  };
  /// Number of loop closures by the true distance between their views.
  struct Closures {
    std::size_t right = 0;    ///< true distance at most `right_within_m`
    std::size_t wrong = 0;    ///< farther
    std::size_t unknown = 0;  ///< the true position of a view is not known
  };

  std::size_t compared = 0;              ///< number of compared positions
  ShapeDifference shape;                 ///< mu [F11]
  Alignment truth_from_map;              ///< least squares, without reflection
  std::optional<Neighbours> neighbours;  ///< nullopt for fewer than 13 positions
};

/// True if the shapes of two sets of points can be compared: as many points in both, at least
/// three, and neither all at one place.
[[nodiscard]] bool is_comparable(std::span<const Point2> map, std::span<const Point2> truth);

/// Compares the shape and the positions of two sets of points, and the 8 nearest neighbours of at
/// most 2000 points, evenly spread. nullopt unless the sets are comparable. `allow_scale`: the
/// scale of the map is fitted, too. Throws ContractError on a coordinate that is not finite. Cost
/// O(n^2) up to 2000 points, 0.2 s, and O(n) above.
[[nodiscard]] std::optional<MapComparison> compare_positions(std::span<const Point2> map,
                                                             std::span<const Point2> truth,
                                                             bool allow_scale = true);

/// Compares the `neighbours` nearest points of each point; ties by order. Throws ContractError on
/// sets of different size, a coordinate that is not finite, and unless 1 <= neighbours and 3
/// neighbours + 1 < 2 points, for which the measure is defined. Cost O(n^2 neighbours).
[[nodiscard]] MapComparison::Neighbours neighbour_preservation(std::span<const Point2> map,
                                                               std::span<const Point2> truth,
                                                               int neighbours);

/// Counts the loop closures of a map by the true distance of their views. `truth` returns the true
/// position of a view; nullopt: unknown.
[[nodiscard]] MapComparison::Closures count_closures(
    const TopologicalMap& map, const std::function<std::optional<Point2>(ViewId)>& truth,
    double right_within_m = 1.0);

}  // namespace panonav
