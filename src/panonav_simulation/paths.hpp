#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/motion/trajectory.hpp"

namespace panonav::simulation {

/// Relative tolerance when a length is divided by a spacing: far above rounding errors, far below
/// any grid spacing.
inline constexpr double rounding_slack = 1e-9;

/// Returns poses every `spacing_m` along the polyline through the positions, from the first on;
/// headings are interpolated. The end is included only if the length is a multiple of the spacing.
/// An empty path gives no poses. Throws ContractError unless spacing_m > 0.
[[nodiscard]] inline std::vector<Pose2> resample(std::span<const Pose2> path, double spacing_m) {
  require(spacing_m > 0.0 && std::isfinite(spacing_m), "spacing_m", spacing_m, "> 0");
  std::vector<Pose2> poses;
  if (path.empty()) return poses;
  poses.push_back(path.front());
  double travelled_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double segment = distance(path[i - 1].position(), path[i].position());
    for (;;) {
      const double next = spacing_m * static_cast<double>(poses.size());
      if (!(next <= travelled_m + segment + rounding_slack * spacing_m) || !(segment > 0.0)) break;
      poses.push_back(
          interpolate(path[i - 1], path[i], std::clamp((next - travelled_m) / segment, 0.0, 1.0)));
    }
    travelled_m += segment;
  }
  return poses;
}

/// A position of a regular grid: column i along x, row j along y.
struct GridPosition {
  int i = 0;        ///< column along x, from 0
  int j = 0;        ///< row along y, from 0
  Point2 position;  ///< in the frame of the rectangle's corners
  friend bool operator==(const GridPosition&, const GridPosition&) = default;
};

/// Order in which `grid_positions` lists the positions.
enum class GridOrder {
  raster,  ///< every row from low x to high x
  zigzag,  ///< every second row backwards [M04 section 4]
};

/// Returns the positions of a grid of `spacing_m`, centred in the rectangle, rows from low y to
/// high y. Throws ContractError unless low <= high and spacing_m > 0.
[[nodiscard]] inline std::vector<GridPosition> grid_positions(Point2 low, Point2 high,
                                                              double spacing_m,
                                                              GridOrder order = GridOrder::raster) {
  require(spacing_m > 0.0 && std::isfinite(spacing_m), "spacing_m", spacing_m, "> 0");
  const auto steps = [spacing_m](const char* field, double extent) {
    require(std::isfinite(extent) && extent >= 0.0, field, extent, ">= 0");
    require(extent / spacing_m < 1e5, field, extent, "less than 100000 spacings");
    return static_cast<int>(std::floor(extent / spacing_m + rounding_slack));
  };
  const int columns = steps("extent of the grid in x", high.x_m - low.x_m) + 1;
  const int rows = steps("extent of the grid in y", high.y_m - low.y_m) + 1;
  constexpr double max_count = 1e7;  // the limit for random poses, too
  require(static_cast<double>(rows) * columns <= max_count, "the option spacing_m", spacing_m,
          "a spacing with at most 10000000 places in the grid");
  const auto margin = [spacing_m](double extent, int count) {
    const double rest = extent - (count - 1) * spacing_m;
    return rest > rounding_slack * spacing_m ? 0.5 * rest : 0.0;
  };
  const Point2 first{low.x_m + margin(high.x_m - low.x_m, columns),
                     low.y_m + margin(high.y_m - low.y_m, rows)};
  std::vector<GridPosition> positions;
  positions.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  for (int j = 0; j < rows; ++j) {
    for (int k = 0; k < columns; ++k) {
      const bool backwards = order == GridOrder::zigzag && j % 2 == 1;
      const int i = backwards ? columns - 1 - k : k;
      positions.push_back({i, j, {first.x_m + i * spacing_m, first.y_m + j * spacing_m}});
    }
  }
  return positions;
}

/// True if the robot can be at a position.
using FreePredicate = std::function<bool(Point2)>;

/// Length and steps of a random walk.
struct RandomWalkOptions {
  int poses = 100;                  ///< >= 1
  double step_m = 0.1;              ///< above 0
  double turn_deviation_rad = 0.2;  ///< standard deviation of the turn per step, >= 0
};

/// Walks in straight steps with small random turns; if the next step is not free, the robot turns
/// to a random direction instead. The heading of a pose is the direction of the step to it. Stops
/// early if no free step is found. Throws ContractError if `start` is not free or an option is
/// out of range.
[[nodiscard]] inline std::vector<Pose2> random_walk(const Pose2& start,
                                                    const FreePredicate& is_free,
                                                    const RandomWalkOptions& options,
                                                    Random& random) {
  require(options.poses >= 1, "poses", options.poses, ">= 1");
  require(options.step_m > 0.0 && std::isfinite(options.step_m), "step_m", options.step_m, "> 0");
  require(options.turn_deviation_rad >= 0.0 && std::isfinite(options.turn_deviation_rad),
          "turn_deviation_rad", options.turn_deviation_rad, ">= 0");
  if (!is_free(start.position())) {
    throw ContractError("start of a random walk",
                        "(" + to_text(start.x_m) + ", " + to_text(start.y_m) + ")", "a free place");
  }
  // If a sector of only 5 degrees is free, 500 random directions miss it with a probability of 0.1
  // %.
  constexpr int max_attempts = 500;
  const auto step_to = [&](const Pose2& from, double heading) -> std::optional<Pose2> {
    const Pose2 next{from.x_m + options.step_m * std::cos(heading),
                     from.y_m + options.step_m * std::sin(heading), wrap_angle(heading)};
    if (is_free(next.position())) return next;
    return std::nullopt;
  };
  std::vector<Pose2> walk{start};
  while (static_cast<int>(walk.size()) < options.poses) {
    const Pose2& here = walk.back();
    auto next = step_to(here, here.heading_rad + random.normal(0.0, options.turn_deviation_rad));
    for (int attempt = 0; !next && attempt < max_attempts; ++attempt) {
      next = step_to(here, random.uniform(-std::numbers::pi, std::numbers::pi));
    }
    if (!next) break;
    walk.push_back(*next);
  }
  return walk;
}

}  // namespace panonav::simulation
