#include "panonav/motion/path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/motion/trajectory.hpp"

namespace panonav {

namespace {

// Ratios of lengths that should be whole numbers miss them by rounding; far above that, far below
// any grid.
constexpr double rounding_slack = 1e-9;

template <class Path, class Position>
double length_of(const Path& path, Position position) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += distance(position(path[i - 1]), position(path[i]));
  }
  return length;
}

}  // namespace

double path_length_m(std::span<const Pose2> path) {
  return length_of(path, [](const Pose2& pose) { return pose.position(); });
}

double path_length_m(std::span<const Point2> path) {
  return length_of(path, [](Point2 point) { return point; });
}

std::vector<Pose2> resample(std::span<const Pose2> path, double spacing_m) {
  require(spacing_m > 0.0 && std::isfinite(spacing_m), "spacing_m", spacing_m, "> 0");
  std::vector<Pose2> poses;
  if (path.empty()) return poses;
  poses.push_back(path.front());
  double walked = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double segment = distance(path[i - 1].position(), path[i].position());
    for (;;) {
      const double next = spacing_m * static_cast<double>(poses.size());
      if (!(next <= walked + segment + rounding_slack * spacing_m) || !(segment > 0.0)) break;
      poses.push_back(
          interpolate(path[i - 1], path[i], std::clamp((next - walked) / segment, 0.0, 1.0)));
    }
    walked += segment;
  }
  return poses;
}

std::vector<GridPosition> grid_positions(Point2 low, Point2 high, double spacing_m,
                                         GridOrder order) {
  require(spacing_m > 0.0 && std::isfinite(spacing_m), "spacing_m", spacing_m, "> 0");
  const auto steps = [spacing_m](const char* field, double extent) {
    require(std::isfinite(extent) && extent >= 0.0, field, extent, ">= 0");
    require(extent / spacing_m < 1e5, field, extent, "less than 100000 spacings");
    return static_cast<int>(std::floor(extent / spacing_m + rounding_slack));
  };
  const int columns = steps("extent of the grid in x", high.x_m - low.x_m) + 1;
  const int rows = steps("extent of the grid in y", high.y_m - low.y_m) + 1;
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

std::vector<Pose2> random_walk(const Pose2& start, const FreePredicate& is_free,
                               const RandomWalkOptions& options, Random& random) {
  require(options.poses >= 1, "poses", options.poses, ">= 1");
  require(options.step_m > 0.0 && std::isfinite(options.step_m), "step_m", options.step_m, "> 0");
  require(options.turn_deviation_rad >= 0.0 && std::isfinite(options.turn_deviation_rad),
          "turn_deviation_rad", options.turn_deviation_rad, ">= 0");
  if (!is_free(start.position())) {
    throw ContractError("start of a random walk",
                        "(" + to_text(start.x_m) + ", " + to_text(start.y_m) + ")", "a free place");
  }
  // With a free sector of 5 degrees, 500 directions miss it once in a thousand times.
  constexpr int tries = 500;
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
    for (int attempt = 0; !next && attempt < tries; ++attempt) {
      next = step_to(here, random.uniform(-std::numbers::pi, std::numbers::pi));
    }
    if (!next) break;
    walk.push_back(*next);
  }
  return walk;
}

}  // namespace panonav
