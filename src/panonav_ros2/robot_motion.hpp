#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

#include "panonav/panorama/tilt.hpp"
#include "panonav_ros2/motion_history.hpp"

namespace panonav::ros2 {

/// Combines the robot's odometry with the last pose found in the map. Thread-safe.
class RobotMotion {
 public:
  using Motion = MotionHistory::Motion;

  MotionHistory::Added add(std::int64_t stamp_ns, const Pose2& odom_from_base) {
    const std::lock_guard lock(mutex_);
    changed_.notify_all();
    return history_.add(stamp_ns, odom_from_base);
  }
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const {
    const std::lock_guard lock(mutex_);
    return history_.newest_ns();
  }
  /// Waits up to 0.3 s for the odometry at this time, which may still arrive; `nullopt` if it does
  /// not.
  [[nodiscard]] std::optional<Motion> wait_for(std::int64_t stamp_ns) {
    std::unique_lock lock(mutex_);
    std::optional<Motion> found;
    changed_.wait_for(lock, std::chrono::milliseconds(300), [&] {
      found = history_.at(stamp_ns);
      return is_stopped_ || found || history_.newest_ns() >= stamp_ns;
    });
    return found;
  }
  /// Ends the current and all later waits.
  void stop() {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    changed_.notify_all();
  }

  void set_tilt(const Tilt& tilt) {
    const std::lock_guard lock(mutex_);
    tilt_ = tilt;
  }
  [[nodiscard]] std::optional<Tilt> tilt() const {
    const std::lock_guard lock(mutex_);
    return tilt_;
  }

  /// Sets the pose, in the map, of the frame of odometry without jumps (`Motion::path_from_base`);
  /// `nullopt` if unknown. Returns the previous one.
  std::optional<Pose2> set_map_from_path(const std::optional<Pose2>& map_from_path) {
    const std::lock_guard lock(mutex_);
    return std::exchange(map_from_path_, map_from_path);
  }
  /// Sets this frame such that the robot is now at `map_from_base`; does nothing before the first
  /// odometry.
  void set_pose(const Pose2& map_from_base) {
    const std::lock_guard lock(mutex_);
    if (const auto now = history_.newest()) {
      map_from_path_ = map_from_base * inverse(now->path_from_base);
    }
  }
  /// Returns the current pose in the map; `nullopt` before the first odometry, and until the robot
  /// is found in the map.
  [[nodiscard]] std::optional<Pose2> map_from_base() const {
    const std::lock_guard lock(mutex_);
    const auto now = history_.newest();
    if (!map_from_path_ || !now) return std::nullopt;
    return *map_from_path_ * now->path_from_base;
  }
  [[nodiscard]] std::optional<Pose2> map_from_odom() const {
    const std::lock_guard lock(mutex_);
    const auto now = history_.newest();
    if (!map_from_path_ || !now) return std::nullopt;
    return *map_from_path_ * now->path_from_base * inverse(now->odom_from_base);
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopped_ = false;
  MotionHistory history_;
  std::optional<Tilt> tilt_;
  std::optional<Pose2> map_from_path_;
};

}  // namespace panonav::ros2
