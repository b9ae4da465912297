#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>

#include "panonav/panorama/tilt.hpp"
#include "ros2/motion_history.hpp"

namespace panonav::ros2 {

/// Where the robot is: by its odometry, and by the last pose that was found in the map. For several
/// threads.
class RobotMotion {
 public:
  using Motion = MotionHistory::Motion;

  MotionHistory::Added add(std::int64_t stamp_ns, const Pose2& odom_from_base);
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const;
  /// Waits up to 0.3 s for the odometry of that time, which may still be under way. `nullopt` when
  /// it does not come.
  [[nodiscard]] std::optional<Motion> wait_for(std::int64_t stamp_ns);
  /// Ends the waiting.
  void stop();

  void set_tilt(const Tilt& tilt);
  [[nodiscard]] std::optional<Tilt> tilt() const;

  /// Sets the frame of the odometry without jumps (`Motion::path_from_base`) in the map; `nullopt`:
  /// unknown. Returns what it was.
  std::optional<Pose2> set_map_from_path(const std::optional<Pose2>& map_from_path);
  /// Sets the same by the pose of the robot now; without odometry nothing changes.
  void set_pose(const Pose2& map_from_base);
  /// `nullopt` before the first odometry, and as long as the robot was not found in the map.
  [[nodiscard]] std::optional<Pose2> map_from_base() const;
  [[nodiscard]] std::optional<Pose2> map_from_odom() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopped_ = false;
  MotionHistory history_;
  std::optional<Tilt> tilt_;
  std::optional<Pose2> map_from_path_;
};

}  // namespace panonav::ros2
