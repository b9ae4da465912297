#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panonav/pipeline/run_messages.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "ros2/goal_driver.hpp"
#include "ros2/node_options.hpp"
#include "ros2/participant.hpp"

namespace panonav::ros2 {

/// Publishes where the robot is, and by which views.
class LocalisationTopics {
 public:
  LocalisationTopics(Participant& participant, FrameNames frames);

  /// Sends map -> odom unless it was sent with that stamp: TF has no two transforms of one time.
  void send_transform(const Pose2& map_from_odom, std::int64_t stamp_ns);
  /// Publishes the positions of the views, with the number of each.
  void publish_references(const VisualMemory& memory, std::int64_t now_ns) const;
  /// Publishes the pose, if the moment is sure of one; particles and the best match for those who
  /// listen.
  void publish_estimate(RunMoment& moment, std::int64_t stamp_ns, const LoadedMemory& memory,
                        const PackedSignature& view) const;
  void publish_state(const RunMoment& moment, std::int64_t stamp_ns) const;

 private:
  FrameNames frames_;
  Publisher<ros::TFMessage> transforms_;
  Publisher<ros::PoseWithCovarianceStamped> poses_;
  Publisher<ros::PoseArray> particles_;
  Publisher<ros::PointCloud2> references_;
  Publisher<ros::CompressedImage> best_matches_;
  Publisher<ros::DiagnosticArray> diagnostics_;
  std::int64_t last_transform_ns_ = 0;
};

}  // namespace panonav::ros2
