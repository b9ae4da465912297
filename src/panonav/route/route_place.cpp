#include "panonav/route/route_place.hpp"

#include <algorithm>
#include <cmath>

namespace panonav {

RoutePlace place_on_route(std::span<const Pose2> path, Point2 position) {
  RoutePlace place{0.0, distance(path.front().position(), position)};
  double least = path.size() > 1 ? INFINITY : 0.0;
  double way = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double ex = path[i + 1].x_m - path[i].x_m;
    const double ey = path[i + 1].y_m - path[i].y_m;
    const double length = std::hypot(ex, ey);
    const double px = position.x_m - path[i].x_m;
    const double py = position.y_m - path[i].y_m;
    const double share =
        length > 0.0 ? std::clamp((px * ex + py * ey) / (length * length), 0.0, 1.0) : 0.0;
    const double off = std::hypot(px - share * ex, py - share * ey);
    if (off < least) {
      least = off;
      place.along_m = way + share * length;
      place.lateral_m = ex * py - ey * px >= 0.0 ? off : -off;
    }
    way += length;
  }
  return place;
}

}  // namespace panonav
