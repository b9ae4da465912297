#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav_recordings/internal/recorded_clock.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

/// Removes a leading slash: ROS 1 writes both "/odom" and "odom".
[[nodiscard]] std::string normalise_frame_name(std::string_view name);

/// Poses over time.
class RecordedTrack {
 public:
  void add(const RecordedTimes& times, const ros::Pose& pose) { samples_.push_back({times, pose}); }
  void keep_only_last() { samples_.erase(samples_.begin(), samples_.end() - 1); }
  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }
  [[nodiscard]] bool has_stamps() const;
  /// Returns the times of all poses. The track must not be sorted yet.
  [[nodiscard]] TimedStream times(std::string name) const;
  /// Sorts the poses by the stamps of `times`, which are in the order of their `order`. From poses
  /// of one stamp only the one recorded last is kept.
  void sort(std::span<const RecordedTimes> times);
  /// Returns the stamps of all poses. Must be sorted.
  [[nodiscard]] std::vector<std::int64_t> stamps_ns() const;
  [[nodiscard]] const ros::Pose& last() const { return samples_.back().pose; }
  /// Returns the stamps of the first and the last pose; nullopt without poses. Must be sorted.
  [[nodiscard]] std::optional<TimeSpan> span() const;
  /// Returns the pose at a time, interpolated, or extrapolated by at most one interval beyond
  /// either end; `nullopt` in gaps of more than `max_gap_ns`. Must be sorted.
  [[nodiscard]] std::optional<ros::Pose> at(std::int64_t ns) const;

 private:
  struct Sample {
    RecordedTimes times;
    ros::Pose pose;
  };
  std::vector<Sample> samples_;
  /// One second, within which a robot can turn or brake; if poses come less often, 1.5 times their
  /// usual interval, at most three seconds (chosen).
  std::int64_t max_gap_ns_ = 0;
};

/// The transforms between two frames. Once a chain connects them, transforms of all other frames
/// are dropped.
class TransformChain {
 public:
  /// Throws ContractError if both frames are the same.
  TransformChain(std::string_view top, std::string_view bottom);

  /// Adds a transform that was recorded at `times`.
  void add(const ros::TransformStamped& transform, const RecordedTimes& times, bool is_static);
  [[nodiscard]] bool is_connected() const noexcept { return connected_; }
  /// Returns the number of ignored transforms that give a frame another parent than an earlier
  /// transform.
  [[nodiscard]] std::size_t ignored_transform_count() const noexcept {
    return ignored_transform_count_;
  }
  [[nodiscard]] bool has_stamps() const;
  /// Returns the tracks that change over time, with the names of their frames.
  [[nodiscard]] std::vector<std::pair<std::string, RecordedTrack*>> moving_tracks();
  /// Returns the stamps at which all moving transforms are known; nullopt if there are none.
  [[nodiscard]] std::optional<TimeSpan> span() const;
  /// Returns top_from_bottom at a time; requires that the chain is connected.
  [[nodiscard]] std::optional<ros::Pose> at(std::int64_t ns) const;
  /// Lists all transforms as "parent -> child", for the error that no chain connects the two
  /// frames.
  [[nodiscard]] std::string list_transforms() const;

 private:
  struct Link {
    std::string parent;
    RecordedTrack track;
    bool is_static = false;
  };

  void connect();

  std::string top_, bottom_;
  std::map<std::string, Link> links_;  // by the name of the child frame
  bool connected_ = false;
  std::size_t ignored_transform_count_ = 0;
};

}  // namespace panonav::recordings
