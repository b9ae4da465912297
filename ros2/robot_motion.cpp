#include "ros2/robot_motion.hpp"

#include <chrono>
#include <utility>

namespace panonav::ros2 {

MotionHistory::Added RobotMotion::add(std::int64_t stamp_ns, const Pose2& odom_from_base) {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
  return history_.add(stamp_ns, odom_from_base);
}

std::optional<std::int64_t> RobotMotion::newest_ns() const {
  const std::lock_guard lock(mutex_);
  return history_.newest_ns();
}

std::optional<RobotMotion::Motion> RobotMotion::wait_for(std::int64_t stamp_ns) {
  std::unique_lock lock(mutex_);
  std::optional<Motion> found;
  changed_.wait_for(lock, std::chrono::milliseconds(300), [&] {
    found = history_.at(stamp_ns);
    return is_stopped_ || found || history_.newest_ns() >= stamp_ns;
  });
  return found;
}

void RobotMotion::stop() {
  const std::lock_guard lock(mutex_);
  is_stopped_ = true;
  changed_.notify_all();
}

void RobotMotion::set_tilt(const Tilt& tilt) {
  const std::lock_guard lock(mutex_);
  tilt_ = tilt;
}

std::optional<Tilt> RobotMotion::tilt() const {
  const std::lock_guard lock(mutex_);
  return tilt_;
}

std::optional<Pose2> RobotMotion::set_map_from_path(const std::optional<Pose2>& map_from_path) {
  const std::lock_guard lock(mutex_);
  return std::exchange(map_from_path_, map_from_path);
}

void RobotMotion::set_pose(const Pose2& map_from_base) {
  const std::lock_guard lock(mutex_);
  if (const auto now = history_.newest()) {
    map_from_path_ = map_from_base * inverse(now->path_from_base);
  }
}

std::optional<Pose2> RobotMotion::map_from_base() const {
  const std::lock_guard lock(mutex_);
  const auto now = history_.newest();
  if (!map_from_path_ || !now) return std::nullopt;
  return *map_from_path_ * now->path_from_base;
}

std::optional<Pose2> RobotMotion::map_from_odom() const {
  const std::lock_guard lock(mutex_);
  const auto now = history_.newest();
  if (!map_from_path_ || !now) return std::nullopt;
  return *map_from_path_ * now->path_from_base * inverse(now->odom_from_base);
}

}  // namespace panonav::ros2
