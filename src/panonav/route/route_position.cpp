#include "panonav/route/route_position.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

namespace {

// Projects a position onto one segment of a path; `along_m` is counted from the segment's start.
RoutePosition project_onto_segment(Point2 from, Point2 to, Point2 position) {
  const double ex = to.x_m - from.x_m;
  const double ey = to.y_m - from.y_m;
  const double length = std::hypot(ex, ey);
  const double px = position.x_m - from.x_m;
  const double py = position.y_m - from.y_m;
  const double share =
      length > 0.0 ? std::clamp((px * ex + py * ey) / (length * length), 0.0, 1.0) : 0.0;
  const double off = std::hypot(px - share * ex, py - share * ey);
  return {share * length, ex * py - ey * px >= 0.0 ? off : -off};
}

}  // namespace

RoutePosition project_onto_route(std::span<const Pose2> path, Point2 position) {
  RoutePosition nearest{0.0, distance(path.front().position(), position)};
  double min_offset_m = path.size() > 1 ? INFINITY : 0.0;
  double passed_m = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Point2 from = path[i].position();
    const Point2 to = path[i + 1].position();
    const RoutePosition here = project_onto_segment(from, to, position);
    if (std::abs(here.lateral_m) < min_offset_m) {
      min_offset_m = std::abs(here.lateral_m);
      nearest = {passed_m + here.along_m, here.lateral_m};
    }
    passed_m += distance(from, to);
  }
  return nearest;
}

std::vector<RoutePosition> find_passes(std::span<const Pose2> path, Point2 position,
                                       double reach_m) {
  std::vector<RoutePosition> passes;
  bool near = false;  // the previous segment is in reach
  double passed_m = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Point2 from = path[i].position();
    const Point2 to = path[i + 1].position();
    RoutePosition here = project_onto_segment(from, to, position);
    here.along_m += passed_m;
    passed_m += distance(from, to);
    const bool was_near = near;
    near = std::abs(here.lateral_m) <= reach_m;
    if (!near) continue;
    if (!was_near) {
      passes.push_back(here);
    } else if (std::abs(here.lateral_m) < std::abs(passes.back().lateral_m)) {
      passes.back() = here;
    }
  }
  return passes;
}

Point2 point_on_route(std::span<const Pose2> path, double along_m) {
  double left_m = std::max(0.0, along_m);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Point2 from = path[i].position();
    const Point2 to = path[i + 1].position();
    const double length = distance(from, to);
    if (left_m < length) {
      const double share = left_m / length;
      return {from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)};
    }
    left_m -= length;
  }
  return path.back().position();
}

std::vector<Point2> route_segment(std::span<const Pose2> path, double from_m, double to_m) {
  const auto [low_m, high_m] = std::minmax(from_m, to_m);
  std::vector<Point2> points{point_on_route(path, low_m)};
  double passed_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    passed_m += distance(path[i - 1].position(), path[i].position());
    if (passed_m > low_m && passed_m < high_m) points.push_back(path[i].position());
  }
  points.push_back(point_on_route(path, high_m));
  if (to_m < from_m) std::ranges::reverse(points);
  return points;
}

}  // namespace panonav
