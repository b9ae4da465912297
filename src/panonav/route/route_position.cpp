#include "panonav/route/route_position.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

namespace {

// Of a position on one part of a path, along that part.
RoutePosition place_beside(Point2 from, Point2 to, Point2 position) {
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
  RoutePosition place{0.0, distance(path.front().position(), position)};
  double least = path.size() > 1 ? INFINITY : 0.0;
  double way = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Point2 from = path[i].position();
    const Point2 to = path[i + 1].position();
    const RoutePosition here = place_beside(from, to, position);
    if (std::abs(here.lateral_m) < least) {
      least = std::abs(here.lateral_m);
      place = {way + here.along_m, here.lateral_m};
    }
    way += distance(from, to);
  }
  return place;
}

std::vector<RoutePosition> find_passes(std::span<const Pose2> path, Point2 position,
                                       double reach_m) {
  std::vector<RoutePosition> places;
  bool near = false;  // the part before this one
  double way = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Point2 from = path[i].position();
    const Point2 to = path[i + 1].position();
    RoutePosition here = place_beside(from, to, position);
    here.along_m += way;
    way += distance(from, to);
    const bool was_near = near;
    near = std::abs(here.lateral_m) <= reach_m;
    if (!near) continue;
    if (!was_near) {
      places.push_back(here);
    } else if (std::abs(here.lateral_m) < std::abs(places.back().lateral_m)) {
      places.back() = here;
    }
  }
  return places;
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
  std::vector<Point2> places{point_on_route(path, low_m)};
  double way_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    way_m += distance(path[i - 1].position(), path[i].position());
    if (way_m > low_m && way_m < high_m) places.push_back(path[i].position());
  }
  places.push_back(point_on_route(path, high_m));
  if (to_m < from_m) std::ranges::reverse(places);
  return places;
}

}  // namespace panonav
