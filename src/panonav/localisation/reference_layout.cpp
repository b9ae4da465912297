#include "panonav/localisation/reference_layout.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <vector>

#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Radius of the disc in which views are counted, in spacings.
constexpr double reach_spacings = 3.0;
/// Tolerance of distances for rounding: views of a grid lie at whole multiples of the spacing.
constexpr double rounding_share = 1e-6;
/// Smallest distance of counted views, in spacings, so that a standing robot counts once.
constexpr double min_apart_spacings = 0.9;
/// Smallest number of counted views of an area. A straight line through the disc has at most 7, the
/// corner of a grid 11; this is the middle.
constexpr std::size_t min_area_views = 9;
/// Largest distance of neighbours on a grid in spacings, diagonal ones included.
constexpr double max_neighbour_spacings = 1.5;
/// Smallest empty sector around a reference at the edge of an area. Three evenly spread neighbours
/// leave sectors of 120 degrees, the rows beside a missing one 90, a line or a straight edge 180;
/// this is between them.
constexpr double min_edge_gap_rad = radians(135.0);
/// Radius within which the direction of a line is computed, in spacings: two views on each side.
constexpr double line_reach_spacings = 2.3;
/// Largest ratio of the standard deviations across and along a line. An arc that turns by 90
/// degrees has 0.2, a sharp corner of 90 degrees 0.5; this is the middle.
constexpr double max_line_ratio = 0.35;

// Counts the points, nearest first, that are at least `apart_m` from those already counted.
std::size_t count_apart(std::span<const Point2> nearest_first, double apart_m) {
  std::vector<Point2> kept;
  for (const Point2 point : nearest_first) {
    if (std::ranges::all_of(kept, [&](Point2 other) { return distance(point, other) >= apart_m; }))
      kept.push_back(point);
  }
  return kept.size();
}

// True if no sector of `min_edge_gap_rad` around `centre` is empty of the points.
bool is_surrounded(Point2 centre, std::span<const Point2> points) {
  std::vector<double> directions;
  for (const Point2 point : points) {
    if (point == centre) continue;
    directions.push_back(std::atan2(point.y_m - centre.y_m, point.x_m - centre.x_m));
  }
  if (directions.empty()) return false;
  std::ranges::sort(directions);
  double gap = directions.front() + 2.0 * std::numbers::pi - directions.back();
  for (std::size_t i = 1; i < directions.size(); ++i) {
    gap = std::max(gap, directions[i] - directions[i - 1]);
  }
  return gap < min_edge_gap_rad;
}

// Returns the direction in which the points are spread most; nullopt if they do not form a line.
std::optional<double> find_line_direction(std::span<const Point2> points) {
  if (points.size() < 3) return std::nullopt;
  const double count = static_cast<double>(points.size());
  Point2 mean;
  for (const Point2 point : points) {
    mean = {mean.x_m + point.x_m / count, mean.y_m + point.y_m / count};
  }
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const Point2 point : points) {
    const double x = point.x_m - mean.x_m;
    const double y = point.y_m - mean.y_m;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  const double middle = 0.5 * (xx + yy);
  const double half = std::hypot(0.5 * (xx - yy), xy);
  if (!(middle + half > 0.0)) return std::nullopt;
  const double ratio = std::sqrt(std::max(0.0, middle - half) / (middle + half));
  if (ratio > max_line_ratio) return std::nullopt;
  return 0.5 * std::atan2(2.0 * xy, xx - yy);
}

}  // namespace

ReferenceLayout::ReferenceLayout(const VisualMemory& memory, double spacing_m)
    : spacing_m_(spacing_m) {
  if (!(spacing_m > 0.0)) return;
  const PointGrid empty((1.0 + rounding_share) * reach_m(spacing_m));
  for (const ViewId view : memory.views()) {
    if (const auto found = find_position(memory.info(view)))
      grids_.try_emplace(std::string(found->floor), empty)
          .first->second.add(view.value, found->point);
  }
}

double ReferenceLayout::reach_m(double spacing_m) noexcept {
  return reach_spacings * spacing_m;
}

LocalLayout ReferenceLayout::around(const FloorPosition& there,
                                    std::span<const ViewId> excluded) const {
  const auto grid = grids_.find(there.floor);
  if (grid == grids_.end()) return {};
  const Point2 position = there.point;
  std::vector<Point2> near;
  grid->second.visit_near(position, [&](std::uint32_t number, Point2 point) {
    if (distance(point, position) > (1.0 + rounding_share) * reach_m(spacing_m_)) return;
    if (std::ranges::find(excluded, ViewId{number}) == excluded.end()) near.push_back(point);
  });
  std::ranges::sort(near, {}, [&](Point2 point) {
    return std::tuple(distance(point, position), point.x_m, point.y_m);
  });
  const auto within = [&](double spacings) {
    const auto end = std::ranges::upper_bound(near, (1.0 + rounding_share) * spacings * spacing_m_,
                                              {}, [&](Point2 p) { return distance(p, position); });
    return std::span(near).first(static_cast<std::size_t>(end - near.begin()));
  };
  if (count_apart(near, min_apart_spacings * spacing_m_) >= min_area_views) {
    const bool is_inside = is_surrounded(position, within(max_neighbour_spacings));
    return {is_inside ? LocalLayout::Kind::area : LocalLayout::Kind::edge};
  }
  const auto direction_rad = find_line_direction(within(line_reach_spacings));
  return direction_rad ? LocalLayout{LocalLayout::Kind::line, *direction_rad} : LocalLayout{};
}

}  // namespace panonav
