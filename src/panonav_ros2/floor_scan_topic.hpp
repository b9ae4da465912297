#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "panonav/io/panorama_reader.hpp"
#include "panonav/navigation/floor_scanner.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav_ros2/node_setup.hpp"
#include "panonav_ros2/participant.hpp"

namespace panonav::ros2 {

/// Returns the message of a scan: azimuths from -pi, infinity where the floor is free up to the
/// range, NaN where the pictures do not show it (REP 117).
[[nodiscard]] recordings::ros::LaserScan make_message(const FloorScan& scan, std::int64_t stamp_ns,
                                                      const std::string& frame);

/// Measures the free floor around a robot with the images that the node receives anyway, and
/// publishes it as `~/floor_scan`.
class FloorScanTopic {
 public:
  /// `pictures`: layout of the images. Throws ContractError if they do not show the floor, or if
  /// the elevations of their pixels were assumed.
  FloorScanTopic(Participant& participant, const LocalisationNodeOptions& options,
                 PictureSource pictures);

  /// Adds an image with its odometry, which are the camera's; publishes a scan if there are
  /// subscribers. Does nothing with a panorama.
  void add(const Observation& observation, std::int64_t stamp_ns, const std::string& frame);

 private:
  PanoramaReader reader_;
  FloorScanner scanner_;
  Publisher<recordings::ros::LaserScan> scans_;
  std::optional<Pose2> last_odometry_;
};

}  // namespace panonav::ros2
