#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

/// Times of a message: when it was recorded, and the stamp of its header.
struct RecordedTimes {
  std::int64_t log_ns = 0;
  std::int64_t stamp_ns = 0;
};

/// Poses over time.
class RecordedTrack {
 public:
  void add(const RecordedTimes& times, const ros::Pose& pose) { samples_.push_back({times, pose}); }
  void keep_only_last() { samples_.erase(samples_.begin(), samples_.end() - 1); }
  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }
  [[nodiscard]] bool has_stamps() const;
  /// Sorts by header stamp or by log time. From poses of one time only the last is kept.
  void sort(bool use_log_times);
  [[nodiscard]] const ros::Pose& last() const { return samples_.back().pose; }
  /// Returns the pose at a time, interpolated, or extrapolated by at most one interval beyond
  /// either end; `nullopt` in gaps of more than a second, within which a robot can turn or brake.
  [[nodiscard]] std::optional<ros::Pose> at(std::int64_t ns) const;

 private:
  struct Sample {
    RecordedTimes times;
    ros::Pose pose;
    std::int64_t at_ns = 0;
  };
  std::vector<Sample> samples_;
};

/// The transforms between two frames. Once a chain connects them, transforms of all other frames
/// are dropped.
class TransformChain {
 public:
  /// Throws ContractError if both frames are the same.
  TransformChain(std::string_view top, std::string_view bottom);

  void add(const ros::TransformStamped& transform, std::int64_t log_ns, bool is_static);
  [[nodiscard]] bool is_connected() const noexcept { return connected_; }
  /// Returns the number of ignored transforms that give a frame another parent than an earlier
  /// transform.
  [[nodiscard]] std::size_t ignored_transform_count() const noexcept {
    return ignored_transform_count_;
  }
  [[nodiscard]] bool has_stamps() const;
  void sort(bool use_log_times);
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
