#include "panonav/motion/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/position_bound.hpp"

namespace panonav {

namespace {

void validate_pose(const StampedPose& pose, const StampedPose* before, std::size_t number) {
  const std::string name = "pose " + std::to_string(number) + " of a trajectory: ";
  const auto finite = [&name](const char* field, double value) {
    require(std::isfinite(value), name + field, value, "a finite number");
  };
  finite("stamp_s", pose.stamp_s);
  require(is_position(pose.pose.x_m), name + "x_m", pose.pose.x_m, position_range);
  require(is_position(pose.pose.y_m), name + "y_m", pose.pose.y_m, position_range);
  finite("heading_rad", pose.pose.heading_rad);
  if (before != nullptr) {
    require(pose.stamp_s > before->stamp_s, name + "stamp_s", pose.stamp_s,
            "> " + to_text(before->stamp_s) + ", the stamp before");
  }
}

}  // namespace

Pose2 interpolate(const Pose2& a, const Pose2& b, double fraction) {
  return {a.x_m + fraction * (b.x_m - a.x_m), a.y_m + fraction * (b.y_m - a.y_m),
          wrap_angle(a.heading_rad + fraction * angle_difference(b.heading_rad, a.heading_rad))};
}

Trajectory::Trajectory(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    validate_pose(poses_[i], i == 0 ? nullptr : &poses_[i - 1], i);
  }
}

void Trajectory::append(const StampedPose& pose) {
  validate_pose(pose, poses_.empty() ? nullptr : &poses_.back(), poses_.size());
  poses_.push_back(pose);
}

std::optional<Pose2> Trajectory::at(double stamp_s, double max_gap_s) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp_s,
                       [](const StampedPose& pose, double stamp) { return pose.stamp_s < stamp; });
  if (after == poses_.end() || std::isnan(stamp_s)) return std::nullopt;
  if (after->stamp_s == stamp_s) return after->pose;
  if (after == poses_.begin()) return std::nullopt;
  const StampedPose& before = *std::prev(after);
  const double gap = after->stamp_s - before.stamp_s;
  if (gap > max_gap_s) return std::nullopt;
  return interpolate(before.pose, after->pose, (stamp_s - before.stamp_s) / gap);
}

}  // namespace panonav
