#include "panonav_ros2/floor_scan_topic.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::ros2 {

namespace {

/// Returns the layout with only the elevations of the floor.
PictureSource keep_floor(PictureSource pictures) {
  // Floor below is within the camera's own robot.
  constexpr double lowest_rad = -1.1;
  ElevationBand band{lowest_rad, FloorScanner::top_rad};
  if (pictures.camera) {
    if (pictures.camera->has_assumed_elevations) {
      throw ContractError("elevations of the camera", "assumed",
                          "measured ones, because the floor is measured by them");
    }
    // Pixels at the edge may show a part of the camera.
    constexpr double border_rad = 0.02;
    band.bottom_rad =
        std::max(lowest_rad, visible_elevations(*pictures.camera).bottom_rad + border_rad);
  } else if (pictures.layout.elevations) {
    band.bottom_rad = std::max(lowest_rad, pictures.layout.elevations->bottom_rad);
  } else if (pictures.kind == PictureKind::panorama) {
    throw ContractError("elevations of the images", "unknown", "known ones, to measure the floor");
  }
  constexpr double highest_bottom_rad = -0.3;
  if (band.bottom_rad > highest_bottom_rad) {
    throw ContractError("lowest elevation of the images", to_text(band.bottom_rad) + " rad",
                        "<= -0.3 rad, to show the floor near the robot");
  }
  pictures.layout.kept_elevations = band;
  return pictures;
}

}  // namespace

recordings::ros::LaserScan make_message(const FloorScan& scan, std::int64_t stamp_ns,
                                        const std::string& frame) {
  const std::size_t sectors = scan.range_m.size();
  const double increment_rad = 2.0 * std::numbers::pi / static_cast<double>(sectors);
  recordings::ros::LaserScan message;
  message.header = {stamp_ns, frame};
  message.angle_min = static_cast<float>(-std::numbers::pi);
  message.angle_max = static_cast<float>(std::numbers::pi - increment_rad);
  message.angle_increment = static_cast<float>(increment_rad);
  message.range_min = static_cast<float>(FloorScanner::min_range_m);
  message.range_max = static_cast<float>(scan.max_range_m);
  for (std::size_t i = 0; i < sectors; ++i) {
    const auto range_m = scan.range_m[(i + sectors / 2) % sectors];
    using Limits = std::numeric_limits<float>;
    message.ranges.push_back(!range_m                       ? Limits::quiet_NaN()
                             : *range_m >= scan.max_range_m ? Limits::infinity()
                                                            : static_cast<float>(*range_m));
  }
  return message;
}

FloorScanTopic::FloorScanTopic(Participant& participant, const LocalisationNodeOptions& options,
                               PictureSource pictures)
    : reader_(keep_floor(std::move(pictures)), {FloorScanner::rows, FloorScanner::columns}),
      scanner_(
          {.camera_height_m = options.camera_height_m, .robot_radius_m = options.robot_radius_m}),
      scans_(participant, "~/floor_scan") {}

void FloorScanTopic::add(const Observation& observation, std::int64_t stamp_ns,
                         const std::string& frame) {
  const auto* const image = std::get_if<Image>(&observation.picture);
  if (image == nullptr) return;
  const Pose2 odometry = observation.odometry.value_or(Pose2{});
  const Pose2 moved = last_odometry_ ? inverse(*last_odometry_) * odometry : Pose2{};
  scanner_.add(reader_.convert(image->view(), observation.tilt.value_or(Tilt{})), moved);
  last_odometry_ = odometry;
  if (scans_.subscribers() > 0) scans_.publish(make_message(scanner_.scan(), stamp_ns, frame));
}

}  // namespace panonav::ros2
