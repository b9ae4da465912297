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
  /// Puts them in order, by the header's stamp or by the log time. Of one time the last stays.
  void sort(bool by_log);
  [[nodiscard]] const ros::Pose& last() const { return samples_.back().pose; }
  /// Interpolated, at either end extrapolated over one interval; empty in gaps of more than a
  /// second, as a robot turns and brakes within one.
  [[nodiscard]] std::optional<ros::Pose> at(std::int64_t ns) const;

 private:
  struct Sample {
    RecordedTimes times;
    ros::Pose pose;
    std::int64_t at_ns = 0;
  };
  std::vector<Sample> samples_;
};

/// The transforms between two frames. Once these are connected, all others are forgotten.
class TransformChain {
 public:
  /// Throws ContractError where both are the same.
  TransformChain(std::string_view top, std::string_view bottom);

  void add(const ros::TransformStamped& transform, std::int64_t log_ns, bool is_static);
  [[nodiscard]] bool connected() const noexcept { return connected_; }
  /// Transforms that give a frame another parent than before, which are left out.
  [[nodiscard]] std::size_t other_parents() const noexcept { return other_parents_; }
  [[nodiscard]] bool has_stamps() const;
  void sort(bool by_log);
  /// top_from_bottom, of a chain that is connected.
  [[nodiscard]] std::optional<ros::Pose> at(std::int64_t ns) const;
  /// Lists all frames, for messages about those that are not connected.
  [[nodiscard]] std::string known() const;

 private:
  struct Link {
    std::string parent;
    RecordedTrack track;
    bool is_static = false;
  };

  void connect();

  std::string top_, bottom_;
  std::map<std::string, Link> links_;  // by child
  bool connected_ = false;
  std::size_t other_parents_ = 0;
};

}  // namespace panonav::recordings
