#include "panonav_ros2/motion_history.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::ros2 {

MotionHistory::Added MotionHistory::add(std::int64_t stamp_ns, const Pose2& odom_from_base) {
  Added added = Added::yes;
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    const std::int64_t step_ns = stamp_ns - last.stamp_ns;
    if (step_ns <= 0 && step_ns > -max_late_ns) return Added::late;
    // A robot may stand still for any time, so a gap in time is no restart; only the distance is
    // checked.
    const double seconds = std::max(0.1, 1e-9 * static_cast<double>(step_ns));
    const bool jumped = distance(odom_from_base.position(), last.odom_from_base.position()) >
                        max_speed_m_s * seconds;
    if (jumped || step_ns < 0) {
      added = Added::restarted;
      path_from_odom_ = path_from_odom_ * last.odom_from_base *
                        inverse(jumped ? odom_from_base : last.odom_from_base);
      samples_.clear();
    }
  }
  samples_.push_back({stamp_ns, odom_from_base});
  while (samples_.front().stamp_ns < stamp_ns - max_age_ns || samples_.size() > max_samples) {
    samples_.pop_front();
  }
  return added;
}

std::optional<MotionHistory::Motion> MotionHistory::at(std::int64_t stamp_ns) const {
  const auto after = std::ranges::lower_bound(samples_, stamp_ns, {}, &Sample::stamp_ns);
  if (after == samples_.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return motion(after->odom_from_base);
  if (after == samples_.begin()) return std::nullopt;
  const Sample& before = *std::prev(after);
  const double share = static_cast<double>(stamp_ns - before.stamp_ns) /
                       static_cast<double>(after->stamp_ns - before.stamp_ns);
  return motion(recordings::ros::to_pose2(
      recordings::ros::interpolate(recordings::ros::to_pose(before.odom_from_base),
                                   recordings::ros::to_pose(after->odom_from_base), share)));
}

std::optional<MotionHistory::Motion> MotionHistory::newest() const {
  if (samples_.empty()) return std::nullopt;
  return motion(samples_.back().odom_from_base);
}

std::optional<std::int64_t> MotionHistory::newest_ns() const {
  if (samples_.empty()) return std::nullopt;
  return samples_.back().stamp_ns;
}

void FrameTree::set(const recordings::ros::TransformStamped& transform) {
  const auto found = links_.find(transform.child_frame_id);
  if (found == links_.end() && links_.size() >= max_frames) return;
  links_.insert_or_assign(transform.child_frame_id,
                          Link{transform.header.frame_id, transform.transform});
}

std::optional<recordings::ros::Pose> FrameTree::lookup(const std::string& top,
                                                       const std::string& bottom) const {
  recordings::ros::Pose frame_from_bottom;
  std::string frame = bottom;
  for (std::size_t hops = 0; frame != top; ++hops) {
    const auto found = links_.find(frame);
    if (found == links_.end()) return std::nullopt;
    if (hops > links_.size()) {
      throw ContractError("parents of the frame " + to_readable_line(bottom), "a cycle", "a tree");
    }
    frame_from_bottom = found->second.parent_from_child * frame_from_bottom;
    frame = found->second.parent;
  }
  return frame_from_bottom;
}

}  // namespace panonav::ros2
