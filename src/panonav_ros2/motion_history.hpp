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

/// Where odometry has a robot, over the last seconds. A publisher that starts again begins at
/// another pose or time; then the motion so far is joined to what comes.
class MotionHistory {
 public:
  static constexpr std::int64_t kept_ns = 10'000'000'000;
  static constexpr std::size_t max_samples = 10'000;
  /// What moves faster between two messages is no robot that drives.
  static constexpr double max_speed_m_s = 20.0;
  /// Of messages: what is older than the newest by less comes late, by more is of another clock.
  static constexpr std::int64_t late_ns = 1'000'000'000;

  struct Motion {
    Pose2 odom_from_base;  ///< as published
    /// In a frame of our own, in which the motion has no jumps.
    Pose2 path_from_base;
  };

  enum class Added { yes, late, restarted };
  Added add(std::int64_t stamp_ns, const Pose2& odom_from_base);

  /// Interpolated. Empty before the first message, and after the newest.
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
  std::deque<Sample> samples_;  // of one run of the publisher
  Pose2 path_from_odom_;
};

/// The transforms that were heard last.
class FrameTree {
 public:
  static constexpr std::size_t max_frames = 1000;

  /// Frames beyond the limit are not kept.
  void set(const recordings::ros::TransformStamped& transform);
  /// top_from_bottom. Empty where no chain connects them. Throws ContractError on a cycle.
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
