#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "panonav/geometry/pose2.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::ros2 {

/// Stores the odometry of the last seconds. When a restarted publisher begins at another pose or
/// time, its motion is appended to the previous motion.
class MotionHistory {
 public:
  static constexpr std::int64_t max_age_ns = 10'000'000'000;
  static constexpr std::size_t max_samples = 10'000;
  /// Speed between two messages above which the odometry has jumped.
  static constexpr double max_speed_m_s = 20.0;
  /// Largest age of a message, relative to the newest, that is late; older ones are from another
  /// clock.
  static constexpr std::int64_t max_late_ns = 1'000'000'000;

  struct Motion {
    Pose2 odom_from_base;  ///< as published
    /// Pose in an internal frame in which the motion has no jumps.
    Pose2 path_from_base;
  };

  enum class Added { yes, late, restarted };
  Added add(std::int64_t stamp_ns, const Pose2& odom_from_base);

  /// Interpolates the motion at a time; `nullopt` before the first and after the newest message.
  [[nodiscard]] std::optional<Motion> at(std::int64_t stamp_ns) const;
  [[nodiscard]] std::optional<Motion> newest() const;
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const;

 private:
  struct Sample {
    std::int64_t stamp_ns = 0;
    Pose2 odom_from_base;
  };
  [[nodiscard]] Motion motion(const Pose2& odom_from_base) const {
    return {odom_from_base, path_from_odom_ * odom_from_base};
  }
  std::deque<Sample> samples_;  // since the publisher's last restart
  Pose2 path_from_odom_;
};

/// Stores the latest transform from each frame to its parent.
class FrameTree {
 public:
  static constexpr std::size_t max_frames = 1000;

  /// Stores a transform; ignores new frames beyond the limit.
  void set(const recordings::ros::TransformStamped& transform);
  /// Returns top_from_bottom; `nullopt` if no chain of transforms connects the frames. Throws
  /// ContractError on a cycle.
  [[nodiscard]] std::optional<recordings::ros::Pose> lookup(const std::string& top,
                                                            const std::string& bottom) const;

 private:
  struct Link {
    std::string parent;
    recordings::ros::Pose parent_from_child;
  };
  std::map<std::string, Link> links_;  // by child
};

}  // namespace panonav::ros2
