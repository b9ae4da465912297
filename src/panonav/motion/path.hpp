#pragma once

#include <functional>
#include <span>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Length of the polyline through the positions; 0 for fewer than two.
[[nodiscard]] double path_length_m(std::span<const Pose2> path);
/// The same for positions alone.
[[nodiscard]] double path_length_m(std::span<const Point2> path);

/// Poses every `spacing_m` along the polyline through the positions, starting with the first;
/// headings are interpolated. The end is included only where it falls on the spacing. Empty for an
/// empty path. Throws ContractError unless spacing_m > 0.
[[nodiscard]] std::vector<Pose2> resample(std::span<const Pose2> path, double spacing_m);

/// A place of a regular grid: column i along x, row j along y.
struct GridPosition {
  int i = 0;        ///< column along x, from 0
  int j = 0;        ///< row along y, from 0
  Point2 position;  ///< in the frame of the rectangle's corners
  friend bool operator==(const GridPosition&, const GridPosition&) = default;
};

/// In which order `grid_positions` goes through the rows.
enum class GridOrder {
  raster,  ///< every row from low x to high x
  zigzag,  ///< every second row backwards, as a robot would drive it [M04 section 4]
};

/// The grid of `spacing_m` that fits into the rectangle, centred in it, rows from low y to high y.
/// Throws ContractError unless low <= high and spacing_m > 0.
[[nodiscard]] std::vector<GridPosition> grid_positions(Point2 low, Point2 high, double spacing_m,
                                                       GridOrder order = GridOrder::raster);

/// Says whether a robot may stand at a place.
using FreePredicate = std::function<bool(Point2)>;

/// How `random_walk` goes.
struct RandomWalkOptions {
  int poses = 100;                  ///< >= 1
  double step_m = 0.1;              ///< above 0
  double turn_deviation_rad = 0.2;  ///< standard deviation of the turn at each step, >= 0
};

/// A walk of straight steps with small random turns; where the next step would leave the free
/// places, the robot turns to a random direction instead. Headings are along the step that led to a
/// pose. Stops early when it is boxed in. Throws ContractError when `start` is not free or an
/// option is out of range.
[[nodiscard]] std::vector<Pose2> random_walk(const Pose2& start, const FreePredicate& is_free,
                                             const RandomWalkOptions& options, Random& random);

}  // namespace panonav
