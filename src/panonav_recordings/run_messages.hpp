#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav_recordings/ros_messages.hpp"
#include "panonav_recordings/run_recorder.hpp"

/// Makes the ROS messages of a moment, for files and for publishing. `frame` is the frame of its
/// poses.
namespace panonav::recordings {

/// Returns the pose of a moment, which must have one. The covariance is zero if the moment has
/// none.
[[nodiscard]] ros::PoseWithCovarianceStamped pose_message(const RunMoment& moment,
                                                          std::int64_t stamp_ns,
                                                          const std::string& frame);
/// Returns a message of several level poses, such as particles.
[[nodiscard]] ros::PoseArray poses_message(const std::vector<Pose2>& poses, std::int64_t stamp_ns,
                                           const std::string& frame);
/// Returns the state of the moment with all its values; the level is 0 if it is sure, else 1.
[[nodiscard]] ros::DiagnosticArray diagnostics_message(const RunMoment& moment,
                                                       std::int64_t stamp_ns);

/// Collects points as float32 for a cloud: x, y, z and one more value each. A message from it is
/// valid until another point is added.
struct PointValues {
  std::vector<float> values;  ///< four for each point

  /// Appends a point at z = 0 with its fourth value.
  void add(const Point2& point, double value);
  /// Returns a cloud of the fields x, y, z and `value_name`.
  [[nodiscard]] ros::PointCloud2 message(std::int64_t stamp_ns, const std::string& frame,
                                         const std::string& value_name) const;
};

/// Returns `count` poses at even steps of the cumulative weight, without randomness; all poses if
/// there are at most `count`.
[[nodiscard]] std::vector<Pose2> resample_systematically(const Particles& particles,
                                                         std::size_t count);

}  // namespace panonav::recordings
