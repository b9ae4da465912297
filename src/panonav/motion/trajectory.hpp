#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose3.hpp"

namespace panonav {

/// A pose at a time.
struct StampedPose {
  double stamp_s = 0.0;  ///< seconds, on a clock that the trajectory's source defines
  Pose2 pose;            ///< in the trajectory's frame
  friend bool operator==(const StampedPose&, const StampedPose&) = default;
};

/// A pose in space at a time.
struct StampedPose3 {
  double stamp_s = 0.0;  ///< seconds, on a clock that the source defines
  Pose3 pose;            ///< in a frame that the source defines
  friend bool operator==(const StampedPose3&, const StampedPose3&) = default;
};

/// Interpolates between poses: position on the straight line, heading along the shorter rotation.
/// Fractions outside 0 .. 1 extrapolate.
[[nodiscard]] Pose2 interpolate(const Pose2& a, const Pose2& b, double fraction);

/// Poses over time. Invariant: all values finite, stamps strictly ascending.
class Trajectory {
 public:
  Trajectory() = default;
  /// Throws ContractError that names the first offending pose.
  explicit Trajectory(std::vector<StampedPose> poses);

  /// All poses, in ascending order of their stamps.
  [[nodiscard]] std::span<const StampedPose> poses() const& noexcept { return poses_; }
  std::span<const StampedPose> poses() const&& = delete;                     // would dangle
  [[nodiscard]] std::size_t size() const noexcept { return poses_.size(); }  ///< Number of poses.
  /// True if there is no pose.
  [[nodiscard]] bool empty() const noexcept { return poses_.empty(); }

  /// Throws ContractError unless the pose is finite and later than the last one.
  void append(const StampedPose& pose);

  /// Interpolates between the two poses around `stamp_s`; nullopt before the first and after the
  /// last pose, and where those two are more than `max_gap_s` apart. O(log n).
  [[nodiscard]] std::optional<Pose2> at(
      double stamp_s, double max_gap_s = std::numeric_limits<double>::infinity()) const;

  friend bool operator==(const Trajectory&, const Trajectory&) = default;

 private:
  std::vector<StampedPose> poses_;
};

}  // namespace panonav
