#include "panonav/route/route_crossing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
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

namespace {

/// Crossings this far beyond the ends of a segment belong to it, as a share of its length, so that
/// no line of sight passes between two segments.
constexpr double share_tolerance = 1e-6;
/// Crossings nearer than this are at a pose of the path: of the segments that meet there, each is
/// crossed in the directions that `find_crossings` counts for it.
constexpr double at_pose_m = 1e-7;

/// True if a line of sight is within the angle in which a segment a, a + e is seen, or opposite.
bool is_in_angle(double ax, double ay, double ex, double ey, Direction2 direction) {
  constexpr double tolerance_rad = 1e-10;
  const double from = std::atan2(ay, ax);
  const double span = angle_difference(std::atan2(ay + ey, ax + ex), from);
  const double middle = from + 0.5 * span;
  const double off = std::abs(angle_difference(std::atan2(direction.y, direction.x), middle));
  return std::min(off, std::numbers::pi - off) <= 0.5 * std::abs(span) + tolerance_rad;
}

}  // namespace

/// The crossing of a line of sight that is nearest to the viewpoint.
struct PathIndex::Nearest {
  std::size_t segment = 0;
  double share = 0.0;
  double across = 0.0;
  double distance_m = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool is_found() const { return std::isfinite(distance_m); }
};

void PathIndex::Box::add(Point2 point) {
  low = {std::min(low.x_m, point.x_m), std::min(low.y_m, point.y_m)};
  high = {std::max(high.x_m, point.x_m), std::max(high.y_m, point.y_m)};
}

double PathIndex::Box::min_distance(Point2 position) const {
  return std::hypot(std::max({0.0, low.x_m - position.x_m, position.x_m - high.x_m}),
                    std::max({0.0, low.y_m - position.y_m, position.y_m - high.y_m}));
}

double PathIndex::Box::max_distance(Point2 position) const {
  return std::hypot(std::max(position.x_m - low.x_m, high.x_m - position.x_m),
                    std::max(position.y_m - low.y_m, high.y_m - position.y_m));
}

PathIndex::PathIndex(std::span<const Pose2> path) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Point2 point = path[i].position();
    points_.push_back(point);
    if (i == 0) bounds_ = {point, point};
    bounds_.add(point);
    if (i % poses_per_block == 0) blocks_.push_back({point, point});
    blocks_.back().add(point);
  }
  set_cells();
}

void PathIndex::set_cells() {
  const double width_m = bounds_.high.x_m - bounds_.low.x_m;
  const double height_m = bounds_.high.y_m - bounds_.low.y_m;
  double length_m = 0.0;
  for (std::size_t i = 1; i < points_.size(); ++i) length_m += distance(points_[i - 1], points_[i]);
  // At most four cells a pose, and on average some ten a segment.
  const double twice = 2.0 * static_cast<double>(std::max<std::size_t>(1, points_.size()));
  cell_m_ = std::max(
      {std::sqrt(width_m * height_m / twice), (width_m + height_m) / twice, length_m / twice});
  if (std::isfinite(cell_m_) && cell_m_ > 0.0) {
    columns_ = static_cast<int>(width_m / cell_m_) + 1;
    rows_ = static_cast<int>(height_m / cell_m_) + 1;
  } else {
    cell_m_ = std::numeric_limits<double>::max();  // one cell
  }
  const auto size = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  cell_begin_.assign(size + 1, 0);
  const auto visit_all = [&](const auto& visit) {
    for (std::size_t i = 0; i + 1 < points_.size(); ++i)
      visit_cells_of_segment(i, [&](std::size_t cell) { visit(cell, i); });
  };
  visit_all([&](std::size_t cell, std::size_t) { ++cell_begin_[cell + 1]; });
  for (std::size_t cell = 0; cell < size; ++cell) cell_begin_[cell + 1] += cell_begin_[cell];
  segments_.resize(cell_begin_.back());
  std::vector<std::uint32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  visit_all([&](std::size_t cell, std::size_t segment) {
    segments_[next[cell]++] = static_cast<std::uint32_t>(segment);
  });
}

PathIndex::Cell PathIndex::find_cell(Point2 position) const {
  const auto find = [&](double from_m, double at_m, int count) {
    const double cell = std::floor((at_m - from_m) / cell_m_);
    return cell > 0.0 ? static_cast<int>(std::min(cell, static_cast<double>(count - 1))) : 0;
  };
  return {find(bounds_.low.x_m, position.x_m, columns_),
          find(bounds_.low.y_m, position.y_m, rows_)};
}

template <class Visit>
void PathIndex::visit_cells_of_segment(std::size_t segment, const Visit& visit) const {
  Point2 from = points_[segment];
  Point2 to = points_[segment + 1];
  if (from.x_m > to.x_m) std::swap(from, to);
  // Wider than the tolerance of crossings and than errors of rounding.
  const double margin_m = 1e-6 * cell_m_ + 2.0 * share_tolerance * distance(from, to);
  const double slope = to.x_m > from.x_m ? (to.y_m - from.y_m) / (to.x_m - from.x_m) : 0.0;
  const int first = find_cell({from.x_m - margin_m, 0.0}).x;
  const int last = find_cell({to.x_m + margin_m, 0.0}).x;
  for (int x = first; x <= last; ++x) {
    double a_m = from.y_m;
    double b_m = to.y_m;
    if (first < last) {
      const double left_m = bounds_.low.x_m + x * cell_m_ - margin_m;
      const auto y_at = [&](double x_m) {
        return from.y_m + slope * (std::clamp(x_m, from.x_m, to.x_m) - from.x_m);
      };
      a_m = x == first ? from.y_m : y_at(left_m);
      b_m = x == last ? to.y_m : y_at(left_m + cell_m_ + 2.0 * margin_m);
    }
    const int low = find_cell({0.0, std::min(a_m, b_m) - margin_m}).y;
    const int high = find_cell({0.0, std::max(a_m, b_m) + margin_m}).y;
    for (int y = low; y <= high; ++y) {
      visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
            static_cast<std::size_t>(x));
    }
  }
}

std::size_t PathIndex::find_nearest(Point2 position) const {
  std::size_t nearest = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t block = 0; block < blocks_.size(); ++block) {
    if (blocks_[block].min_distance(position) > nearest_m) continue;
    const std::size_t begin = block * poses_per_block;
    for (std::size_t i = begin; i < std::min(begin + poses_per_block, points_.size()); ++i) {
      const double here_m = distance(points_[i], position);
      if (here_m >= nearest_m) continue;
      nearest_m = here_m;
      nearest = i;
    }
  }
  return nearest;
}

std::optional<LineWindow> PathIndex::find_window(Point2 position, double reach_m) const {
  const std::size_t nearest = find_nearest(position);
  const auto is_in_reach = [&](std::size_t i) { return distance(points_[i], position) < reach_m; };
  const auto is_block_in_reach = [&](std::size_t block) {
    return blocks_[block].max_distance(position) < reach_m;
  };
  if (!is_in_reach(nearest)) return std::nullopt;
  LineWindow found{nearest, nearest + 1, reach_m};
  while (found.begin > 0) {
    if (found.begin % poses_per_block == 0 &&
        is_block_in_reach(found.begin / poses_per_block - 1)) {
      found.begin -= poses_per_block;
    } else if (is_in_reach(found.begin - 1)) {
      --found.begin;
    } else {
      break;
    }
  }
  while (found.end < points_.size()) {
    if (found.end % poses_per_block == 0 && is_block_in_reach(found.end / poses_per_block)) {
      found.end = std::min(found.end + poses_per_block, points_.size());
    } else if (is_in_reach(found.end)) {
      ++found.end;
    } else {
      break;
    }
  }
  if (found.end - found.begin < 2) return std::nullopt;
  return found;
}

// Visits the cells along `sign * direction` in order, until the nearest crossing is nearer than the
// next cell.
void PathIndex::search_along(const LineWindow& window, Point2 viewpoint, Direction2 direction,
                             double sign, Nearest& nearest) const {
  const Direction2 ray{sign * direction.x, sign * direction.y};
  // Distances along the ray at which it enters and leaves the grid.
  double enter_m = 0.0;
  double leave_m = window.reach_m;
  const auto clip = [&](double low_m, double high_m, double at_m, double speed) {
    if (std::abs(speed) < 1e-12) {
      if (at_m < low_m || at_m > high_m) leave_m = -1.0;
      return;
    }
    const auto [first, second] = std::minmax({(low_m - at_m) / speed, (high_m - at_m) / speed});
    enter_m = std::max(enter_m, first);
    leave_m = std::min(leave_m, second);
  };
  const double margin_m = 1e-6 * cell_m_;
  clip(bounds_.low.x_m - margin_m, bounds_.high.x_m + margin_m, viewpoint.x_m, ray.x);
  clip(bounds_.low.y_m - margin_m, bounds_.high.y_m + margin_m, viewpoint.y_m, ray.y);
  if (enter_m > leave_m) return;
  Cell cell = find_cell({viewpoint.x_m + enter_m * ray.x, viewpoint.y_m + enter_m * ray.y});
  // Distances along the ray at which it enters the next column and row of cells.
  const auto find_next = [&](double low_m, int at, double from_m, double speed) {
    if (std::abs(speed) < 1e-12) return std::numeric_limits<double>::infinity();
    return (low_m + (at + (speed > 0.0 ? 1 : 0)) * cell_m_ - from_m) / speed;
  };
  double next_x_m = find_next(bounds_.low.x_m, cell.x, viewpoint.x_m, ray.x);
  double next_y_m = find_next(bounds_.low.y_m, cell.y, viewpoint.y_m, ray.y);
  const double step_x_m = cell_m_ / std::max(1e-12, std::abs(ray.x));
  const double step_y_m = cell_m_ / std::max(1e-12, std::abs(ray.y));
  while (cell.x >= 0 && cell.x < columns_ && cell.y >= 0 && cell.y < rows_) {
    const auto at = static_cast<std::size_t>(cell.y) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(cell.x);
    for (std::uint32_t k = cell_begin_[at]; k < cell_begin_[at + 1]; ++k) {
      const std::size_t i = segments_[k];
      if (i < window.begin || i + 1 >= window.end) continue;
      const double ax = points_[i].x_m - viewpoint.x_m;
      const double ay = points_[i].y_m - viewpoint.y_m;
      const double ex = points_[i + 1].x_m - points_[i].x_m;
      const double ey = points_[i + 1].y_m - points_[i].y_m;
      const double across = ex * direction.y - ey * direction.x;
      if (std::abs(across) < 1e-9) continue;
      // viewpoint + distance_m u = a + share e.
      const double share = (ay * direction.x - ax * direction.y) / across;
      if (share < -share_tolerance || share > 1.0 + share_tolerance) continue;
      const double distance_m = (ax + share * ex) * direction.x + (ay + share * ey) * direction.y;
      if (std::abs(distance_m) < at_pose_m && !is_in_angle(ax, ay, ex, ey, direction)) continue;
      const double closer_m = std::abs(nearest.distance_m) - std::abs(distance_m);
      if (closer_m < 0.0 || (closer_m == 0.0 && i >= nearest.segment)) continue;
      nearest = {i, share, across, distance_m};
    }
    if (std::min(std::abs(nearest.distance_m), leave_m) < std::min(next_x_m, next_y_m)) return;
    if (next_x_m < next_y_m) {
      cell.x += ray.x > 0.0 ? 1 : -1;
      next_x_m += step_x_m;
    } else {
      cell.y += ray.y > 0.0 ? 1 : -1;
      next_y_m += step_y_m;
    }
  }
}

void PathIndex::find_crossings(const LineWindow& window, Point2 viewpoint,
                               std::span<const Direction2> directions,
                               std::span<RouteCrossing> crossings) const {
  std::ranges::fill(crossings, RouteCrossing{});
  const std::size_t count = directions.size();
  // Opposite directions are on the same line of sight.
  const std::size_t lines = count % 2 == 0 ? count / 2 : count;
  for (std::size_t c = 0; c < lines; ++c) {
    Nearest nearest;
    for (const double sign : {1.0, -1.0})
      search_along(window, viewpoint, directions[c], sign, nearest);
    if (!nearest.is_found()) continue;
    RouteCrossing& found = crossings[c];
    found.along = static_cast<float>(static_cast<double>(nearest.segment) +
                                     std::clamp(nearest.share, 0.0, 1.0));
    found.distance_m = static_cast<float>(nearest.distance_m);
    found.along_by_x = static_cast<float>(directions[c].y / nearest.across);
    found.along_by_y = static_cast<float>(-directions[c].x / nearest.across);
    if (lines == count) continue;
    crossings[c + lines] = found;
    crossings[c + lines].distance_m = -found.distance_m;
  }
}

}  // namespace panonav
