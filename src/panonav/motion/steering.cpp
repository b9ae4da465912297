#include "panonav/motion/steering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

void visit_options(SteeringOptions& options, OptionVisitor& visitor) {
  using T = SteeringOptions;
  constexpr OptionTable table{
      option<&T::turn_gain>("share of the error of direction turned in one step", 0.01, 1),
      option<&T::max_turn_rad>("turned in one step at most", 0.01, 3.2),
      option<&T::travel_gain>("share of the way that is left driven in one step", 0.01, 1),
      option<&T::step_m>("driven in one step at most", 1e-3, 10),
      option<&T::on_spot_rad>("the robot turns on the spot for larger errors of direction", 0.05,
                              1.5),
  };
  table.visit(options, visitor);
}

void visit_options(PathFollowerOptions& options, OptionVisitor& visitor) {
  using T = PathFollowerOptions;
  constexpr OptionTable table{
      option<&T::look_ahead_m>("the robot steers to the place of the path so far ahead", 0.01, 100),
      option<&T::max_cut_m>("by which the straight way to that place may leave the path", 1e-3, 10),
      option<&T::arrived_m>("so near to the end of the path the robot has arrived", 1e-3, 10),
      options_of<&T::steering>(),
  };
  table.visit(options, visitor);
}

Pose2 steer_to(const Pose2& robot, Point2 goal, const SteeringOptions& options) {
  validate(options);
  const double dx = goal.x_m - robot.x_m;
  const double dy = goal.y_m - robot.y_m;
  const double off = angle_difference(std::atan2(dy, dx), robot.heading_rad);
  const double turn =
      std::clamp(options.turn_gain * off, -options.max_turn_rad, options.max_turn_rad);
  const double travel_m =
      std::abs(off) > options.on_spot_rad
          ? 0.0
          : std::min(options.step_m, options.travel_gain * std::hypot(dx, dy)) * std::cos(off);
  // Wheels without slip: the chord of the step points along the heading at its middle.
  return {travel_m * std::cos(0.5 * turn), travel_m * std::sin(0.5 * turn), turn};
}

PathFollower::PathFollower(std::span<const Point2> path, const PathFollowerOptions& options)
    : options_(options), path_(path.begin(), path.end()) {
  validate(options);
  if (path.size() < 2) {
    throw ContractError("places of the path", static_cast<double>(path.size()), "2 or more");
  }
  way_m_.push_back(0.0);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!std::isfinite(path[i].x_m) || !std::isfinite(path[i].y_m)) {
      throw ContractError("place of the path", "not finite", "finite numbers");
    }
    if (i > 0) way_m_.push_back(way_m_.back() + distance(path[i - 1], path[i]));
  }
}

Point2 PathFollower::place_at(double along_m) const {
  const auto after = std::ranges::upper_bound(way_m_, along_m);
  if (after == way_m_.end()) return path_.back();
  const auto i = static_cast<std::size_t>(after - way_m_.begin());
  if (i == 0) return path_.front();
  const double share = (along_m - way_m_[i - 1]) / (way_m_[i] - way_m_[i - 1]);
  return {path_[i - 1].x_m + share * (path_[i].x_m - path_[i - 1].x_m),
          path_[i - 1].y_m + share * (path_[i].y_m - path_[i - 1].y_m)};
}

// To the place nearest to the robot, from its last one on and not farther than it can have driven,
// even if it has cut a corner.
void PathFollower::advance(Point2 robot) {
  const double max_m = along_m_ + 2.0 * options_.look_ahead_m;
  double least = std::numeric_limits<double>::infinity();
  double best_m = along_m_;
  const auto first = std::ranges::upper_bound(way_m_, along_m_);
  auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, first - way_m_.begin()));
  for (; i < path_.size() && way_m_[i - 1] <= max_m; ++i) {
    const double ex = path_[i].x_m - path_[i - 1].x_m;
    const double ey = path_[i].y_m - path_[i - 1].y_m;
    const double length = way_m_[i] - way_m_[i - 1];
    if (!(length > 0.0)) continue;
    const double foot =
        ((robot.x_m - path_[i - 1].x_m) * ex + (robot.y_m - path_[i - 1].y_m) * ey) / length;
    const double there_m =
        std::clamp(way_m_[i - 1] + std::clamp(foot, 0.0, length), along_m_, max_m);
    const double off = distance(place_at(there_m), robot);
    if (off < least) {
      least = off;
      best_m = there_m;
    }
  }
  along_m_ = best_m;
}

// As far ahead as the path stays near the straight way there.
Point2 PathFollower::place_ahead() const {
  const Point2 here = place();
  // Nearer, the robot would turn for every error of its position.
  double ahead_m = along_m_ + options_.look_ahead_m / 3.0;
  const double max_m = along_m_ + options_.look_ahead_m;
  const auto leaves = [&](Point2 there) {
    const double ex = there.x_m - here.x_m;
    const double ey = there.y_m - here.y_m;
    const double length = std::hypot(ex, ey);
    if (!(length > 0.0)) return true;
    const auto first = std::ranges::upper_bound(way_m_, along_m_);
    for (auto i = static_cast<std::size_t>(first - way_m_.begin());
         i < path_.size() && way_m_[i] < ahead_m; ++i) {
      const double off = (path_[i].x_m - here.x_m) * ey - (path_[i].y_m - here.y_m) * ex;
      if (std::abs(off) > options_.max_cut_m * length) return true;
    }
    return false;
  };
  constexpr int steps = 8;
  const double step_m = (max_m - ahead_m) / steps;
  Point2 there = place_at(ahead_m);
  for (int i = 0; i < steps; ++i) {
    ahead_m += step_m;
    const Point2 farther = place_at(ahead_m);
    if (leaves(farther)) break;
    there = farther;
  }
  return there;
}

std::optional<Point2> PathFollower::next_aim(Point2 robot) {
  advance(robot);
  // A robot beside the end has arrived, too.
  const double left_m = length_m() - along_m_;
  const bool near = distance(robot, path_.back()) <= options_.arrived_m;
  if (left_m <= 1e-9 || (near && left_m <= options_.look_ahead_m)) return std::nullopt;
  return place_ahead();
}

std::optional<Pose2> PathFollower::next_step(const Pose2& robot) {
  const auto aim = next_aim(robot.position());
  if (!aim) return std::nullopt;
  return steer_to(robot, *aim, options_.steering);
}

}  // namespace panonav
