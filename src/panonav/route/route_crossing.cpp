#include "panonav/route/route_crossing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "panonav/geometry/angles.hpp"

namespace panonav {

std::vector<Direction2> equal_directions(std::size_t count) {
  std::vector<Direction2> directions(count);
  for (std::size_t c = 0; c < count; ++c) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(c) / static_cast<double>(count);
    directions[c] = {std::cos(angle), std::sin(angle)};
  }
  return directions;
}

void find_crossings(std::span<const Pose2> path, std::size_t first, Point2 viewpoint,
                    std::span<const Direction2> directions, std::span<RouteCrossing> crossings) {
  std::ranges::fill(crossings, RouteCrossing{});
  const std::size_t count = crossings.size();
  if (path.size() < 2 || count == 0) return;
  const double columns_per_rad = static_cast<double>(count) / (2.0 * std::numbers::pi);
  double from = std::atan2(path[0].y_m - viewpoint.y_m, path[0].x_m - viewpoint.x_m);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double ax = path[i].x_m - viewpoint.x_m;
    const double ay = path[i].y_m - viewpoint.y_m;
    const double ex = path[i + 1].x_m - path[i].x_m;
    const double ey = path[i + 1].y_m - path[i].y_m;
    const double to = std::atan2(ay + ey, ax + ex);
    const double span = angle_difference(to, from);
    const double low = span >= 0.0 ? from : to;
    const double width = std::abs(span);
    from = to;
    // The section ahead of the viewpoint, then behind it.
    for (const double offset_rad : {0.0, std::numbers::pi}) {
      const auto begin =
          static_cast<long long>(std::ceil((low + offset_rad) * columns_per_rad - 1e-9));
      const auto end =
          static_cast<long long>(std::floor((low + offset_rad + width) * columns_per_rad + 1e-9));
      if (begin > end) continue;
      const auto size = static_cast<long long>(count);
      long long column = ((begin % size) + size) % size;
      for (long long k = begin; k <= end; ++k, ++column) {
        if (column == size) column = 0;
        const auto c = static_cast<std::size_t>(column);
        const double ux = directions[c].x;
        const double uy = directions[c].y;
        const double across = ex * uy - ey * ux;
        if (std::abs(across) < 1e-9) continue;
        // viewpoint + distance_m u = a + share e.
        const double share = (ay * ux - ax * uy) / across;
        if (share < -1e-6 || share > 1.0 + 1e-6) continue;
        const double distance_m = (ax + share * ex) * ux + (ay + share * ey) * uy;
        RouteCrossing& best = crossings[c];
        if (best.along >= 0.0F &&
            std::abs(distance_m) >= std::abs(static_cast<double>(best.distance_m))) {
          continue;
        }
        best.along =
            static_cast<float>(static_cast<double>(first + i) + std::clamp(share, 0.0, 1.0));
        best.distance_m = static_cast<float>(distance_m);
        best.along_by_x = static_cast<float>(uy / across);
        best.along_by_y = static_cast<float>(-ux / across);
      }
    }
  }
}

}  // namespace panonav
