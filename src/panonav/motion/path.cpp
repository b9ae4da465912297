#include "panonav/motion/path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

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

Point2 mix(Point2 a, Point2 b, double fraction) {
  return {a.x_m + fraction * (b.x_m - a.x_m), a.y_m + fraction * (b.y_m - a.y_m)};
}

// One span of a Catmull-Rom spline between p[1] and p[2] (Barry and Goldman's pyramid).
class SplineSpan {
 public:
  explicit SplineSpan(const std::array<Point2, 4>& points) : points_(points) {
    for (std::size_t i = 1; i < 4; ++i) {
      // The square root of the distance makes the parametrisation centripetal.
      knots_[i] = knots_[i - 1] + std::sqrt(distance(points[i - 1], points[i]));
    }
  }

  // fraction 0 .. 1 between p[1] and p[2]
  [[nodiscard]] Point2 at(double fraction) const {
    const double t = knots_[1] + fraction * (knots_[2] - knots_[1]);
    std::array<Point2, 4> level = points_;
    for (std::size_t depth = 1; depth < 4; ++depth) {
      for (std::size_t i = 0; i + depth < 4; ++i) {
        // The last two levels interpolate over the inner knots only.
        const std::size_t low = depth == 3 ? 1 : i;
        const std::size_t high = depth == 3 ? 2 : i + depth;
        level[i] = mix(level[i], level[i + 1], (t - knots_[low]) / (knots_[high] - knots_[low]));
      }
    }
    return level[0];
  }

 private:
  std::array<Point2, 4> points_;
  std::array<double, 4> knots_{};
};

Point2 mirrored(Point2 end, Point2 inner) {
  return {2.0 * end.x_m - inner.x_m, 2.0 * end.y_m - inner.y_m};
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

std::vector<Pose2> smooth_path(std::span<const Point2> way_points,
                               const SmoothPathOptions& options) {
  require(options.spacing_m > 0.0 && std::isfinite(options.spacing_m), "spacing_m",
          options.spacing_m, "> 0");
  std::vector<Point2> points;
  for (const Point2 point : way_points) {
    require(std::isfinite(point.x_m), "x_m of a way point", point.x_m, "a finite number");
    require(std::isfinite(point.y_m), "y_m of a way point", point.y_m, "a finite number");
    if (points.empty() || point != points.back()) points.push_back(point);
  }
  if (options.closed && points.size() > 1 && points.front() == points.back()) points.pop_back();
  const std::size_t least = options.closed ? 3 : 2;
  require(points.size() >= least, "number of different way points",
          static_cast<double>(points.size()), ">= " + std::to_string(least));

  const std::size_t count = points.size();
  const auto neighbour = [&](std::size_t i, int offset) {
    const auto index = static_cast<std::ptrdiff_t>(i) + offset;
    if (options.closed)
      return points[static_cast<std::size_t>(index + static_cast<std::ptrdiff_t>(count)) % count];
    if (index < 0) return mirrored(points[0], points[1]);
    if (index >= static_cast<std::ptrdiff_t>(count))
      return mirrored(points[count - 1], points[count - 2]);
    return points[static_cast<std::size_t>(index)];
  };

  // A polyline so fine that its chords and the curve differ by far less than the spacing.
  std::vector<Pose2> fine;
  const std::size_t spans = options.closed ? count : count - 1;
  for (std::size_t i = 0; i < spans; ++i) {
    const SplineSpan span({neighbour(i, -1), neighbour(i, 0), neighbour(i, 1), neighbour(i, 2)});
    const double chord = distance(neighbour(i, 0), neighbour(i, 1));
    const int pieces =
        std::max(16, static_cast<int>(std::ceil(std::min(20.0 * chord / options.spacing_m, 1e6))));
    const double h = 1e-3 / pieces;
    for (int piece = 0; piece <= pieces; ++piece) {
      if (piece == 0 && i > 0) continue;
      const double fraction = static_cast<double>(piece) / pieces;
      const Point2 position = span.at(fraction);
      const Point2 before = span.at(std::max(0.0, fraction - h));
      const Point2 after = span.at(std::min(1.0, fraction + h));
      const double heading = std::atan2(after.y_m - before.y_m, after.x_m - before.x_m);
      fine.push_back({position.x_m, position.y_m, wrap_angle(heading)});
    }
  }
  return resample(fine, options.spacing_m);
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
