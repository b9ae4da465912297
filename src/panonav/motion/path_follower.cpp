#include "panonav/motion/path_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

void visit_options(PathFollowerOptions& options, OptionVisitor& visitor) {
  using T = PathFollowerOptions;
  constexpr OptionTable table{
      option<&T::look_ahead_m>("distance along the path to the point to which the robot steers",
                               0.01, 100),
      option<&T::max_cut_m>("largest distance between the path and the straight line to this point",
                            1e-3, 10),
      option<&T::arrived_m>("distance from the end of the path at which the robot arrives", 1e-3,
                            10),
  };
  table.visit(options, visitor);
}

PathFollower::PathFollower(std::span<const Point2> path, const PathFollowerOptions& options)
    : options_(options), path_(path.begin(), path.end()) {
  validate(options);
  if (path.size() < 2) {
    throw ContractError("points of the path", static_cast<double>(path.size()), "2 or more");
  }
  path_length_to_point_m_.push_back(0.0);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!std::isfinite(path[i].x_m) || !std::isfinite(path[i].y_m)) {
      throw ContractError("point of the path", "not finite", "finite numbers");
    }
    if (i > 0)
      path_length_to_point_m_.push_back(path_length_to_point_m_.back() +
                                        distance(path[i - 1], path[i]));
  }
}

Point2 PathFollower::position_at(double along_m) const {
  const auto after = std::ranges::upper_bound(path_length_to_point_m_, along_m);
  if (after == path_length_to_point_m_.end()) return path_.back();
  const auto i = static_cast<std::size_t>(after - path_length_to_point_m_.begin());
  if (i == 0) return path_.front();
  const double share = (along_m - path_length_to_point_m_[i - 1]) /
                       (path_length_to_point_m_[i] - path_length_to_point_m_[i - 1]);
  return {path_[i - 1].x_m + share * (path_[i].x_m - path_[i - 1].x_m),
          path_[i - 1].y_m + share * (path_[i].y_m - path_[i - 1].y_m)};
}

// Moves the position on the path to the nearest point within twice the look-ahead distance after
// the last position: farther than the robot can have driven, even if it cut a corner.
void PathFollower::advance_to_nearest(Point2 robot) {
  const double max_m = along_m_ + 2.0 * options_.look_ahead_m;
  double min_distance_m = std::numeric_limits<double>::infinity();
  double best_m = along_m_;
  const auto first = std::ranges::upper_bound(path_length_to_point_m_, along_m_);
  auto i = static_cast<std::size_t>(
      std::max<std::ptrdiff_t>(1, first - path_length_to_point_m_.begin()));
  for (; i < path_.size() && path_length_to_point_m_[i - 1] <= max_m; ++i) {
    const double ex = path_[i].x_m - path_[i - 1].x_m;
    const double ey = path_[i].y_m - path_[i - 1].y_m;
    const double length = path_length_to_point_m_[i] - path_length_to_point_m_[i - 1];
    if (!(length > 0.0)) continue;
    const double projection_m =
        ((robot.x_m - path_[i - 1].x_m) * ex + (robot.y_m - path_[i - 1].y_m) * ey) / length;
    const double candidate_m = std::clamp(
        path_length_to_point_m_[i - 1] + std::clamp(projection_m, 0.0, length), along_m_, max_m);
    const double distance_m = distance(position_at(candidate_m), robot);
    if (distance_m < min_distance_m) {
      min_distance_m = distance_m;
      best_m = candidate_m;
    }
  }
  along_m_ = best_m;
}

// Finds the farthest point, within the look-ahead, to which the straight line stays within
// `max_cut_m` of the path.
Point2 PathFollower::find_target() const {
  const Point2 here = position();
  // Smallest distance of the target: with a nearer one, small position errors would cause large
  // rotations.
  double ahead_m = along_m_ + options_.look_ahead_m / 3.0;
  const double max_m = along_m_ + options_.look_ahead_m;
  const auto is_cut_too_wide = [&](Point2 target) {
    const double ex = target.x_m - here.x_m;
    const double ey = target.y_m - here.y_m;
    const double length = std::hypot(ex, ey);
    if (!(length > 0.0)) return true;
    const auto first = std::ranges::upper_bound(path_length_to_point_m_, along_m_);
    for (auto i = static_cast<std::size_t>(first - path_length_to_point_m_.begin());
         i < path_.size() && path_length_to_point_m_[i] < ahead_m; ++i) {
      const double off = (path_[i].x_m - here.x_m) * ey - (path_[i].y_m - here.y_m) * ex;
      if (std::abs(off) > options_.max_cut_m * length) return true;
    }
    return false;
  };
  constexpr int steps = 8;
  const double step_m = (max_m - ahead_m) / steps;
  Point2 target = position_at(ahead_m);
  for (int i = 0; i < steps; ++i) {
    ahead_m += step_m;
    const Point2 farther = position_at(ahead_m);
    if (is_cut_too_wide(farther)) break;
    target = farther;
  }
  return target;
}

std::optional<Point2> PathFollower::next_target(Point2 robot) {
  advance_to_nearest(robot);
  // A robot within `arrived_m` of the end has also arrived if its position on the path is almost at
  // the end.
  const double remaining_m = length_m() - along_m_;
  const bool near = distance(robot, path_.back()) <= options_.arrived_m;
  if (remaining_m <= 1e-9 || (near && remaining_m <= options_.look_ahead_m)) return std::nullopt;
  return find_target();
}

}  // namespace panonav
