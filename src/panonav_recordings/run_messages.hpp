#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav_recordings/ros_messages.hpp"
#include "panonav_recordings/run_recorder.hpp"

/// The ROS messages that tell a moment, in files and on the wire. `frame` is that of its poses.
namespace panonav::recordings {

/// The moment has a pose. The covariance is zero where the moment has none.
[[nodiscard]] ros::PoseWithCovarianceStamped pose_message(const RunMoment& moment,
                                                          std::int64_t stamp_ns,
                                                          const std::string& frame);
/// Several poses, each level, such as particles or directions.
[[nodiscard]] ros::PoseArray poses_message(const std::vector<Pose2>& poses, std::int64_t stamp_ns,
                                           const std::string& frame);
/// The state of the moment, its level 0 where it is sure and 1 otherwise, with all its values.
[[nodiscard]] ros::DiagnosticArray diagnostics_message(const RunMoment& moment,
                                                       std::int64_t stamp_ns);

/// x, y, z and one more value of each point, as float32. A message of it is there as long as this
/// is and nothing is added.
struct PointValues {
  std::vector<float> values;  ///< four for each point

  /// Appends a point at z = 0 with its fourth value.
  void add(const Point2& point, double value);
  /// A cloud of the fields x, y, z and `fourth`.
  [[nodiscard]] ros::PointCloud2 message(std::int64_t stamp_ns, const std::string& frame,
                                         const std::string& fourth) const;
};

/// `count` particles drawn evenly by weight; all of them where there are fewer. No randomness.
[[nodiscard]] std::vector<Pose2> resample_systematically(const Particles& particles,
                                                         std::size_t count);

}  // namespace panonav::recordings
