#include "panonav_ros2/obstacle_topics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::ros2 {

namespace {

// Largest difference between the times of a scan and an image: 15 cm of motion at 0.3 m/s, which
// the odometry between them corrects.
constexpr std::int64_t max_age_ns = 500'000'000;
// Rays without an echo end here: explorations use shorter ranges only.
constexpr double max_length_m = 10.0;
// Standard deviation of a range, and its part that is proportional to the range: an infrared or
// ultrasonic rangefinder; lasers are better.
constexpr double range_noise_m = 0.01;
constexpr double range_noise_factor = 0.02;

}  // namespace

ObstacleTopics::ObstacleTopics(Participant& participant, const FrameNames& frames, WarningLog& log,
                               RobotMotion& motion)
    : frames_(frames), motion_(motion) {
  subscribe<recordings::ros::TFMessage>(participant, log, "/tf_static",
                                        {.depth = 100, .transient_local = true},
                                        [this](const recordings::ros::TFMessage& message) {
                                          for (const auto& each : message.transforms)
                                            tree_.set(each);
                                        });
  subscribe<recordings::ros::LaserScan>(
      participant, log, "scan", {},
      [this](const recordings::ros::LaserScan& scan) { receive(scan); });
  subscribe<recordings::ros::PointStamped>(
      participant, log, "contact", {},
      [this](const recordings::ros::PointStamped& contact) { receive(contact); });
}

recordings::ros::Pose ObstacleTopics::base_from(const std::string& topic,
                                                const std::string& frame) const {
  if (frame == frames_.base) return {};
  const auto pose = tree_.lookup(frames_.base, frame);
  if (!pose) {
    throw ContractError("frame of " + topic,
                        "'" + to_readable_line(shorten_middle(frame, 60)) + "'",
                        frames_.base + ", or one that /tf_static connects to it");
  }
  return *pose;
}

void ObstacleTopics::receive(const recordings::ros::LaserScan& message) {
  require(std::isfinite(message.angle_min) && std::isfinite(message.angle_increment),
          "angles of scan", message.angle_increment, "finite");
  require(message.range_min >= 0.0F && message.range_max > message.range_min, "range_max of scan",
          message.range_max, "above range_min, which is 0 or more");
  const recordings::ros::Pose base_from_sensor = base_from("scan", message.header.frame_id);
  Scan scan{message.header.stamp_ns, {}, {}};
  for (std::size_t i = 0; i < message.ranges.size(); ++i) {
    const auto range_m = static_cast<double>(message.ranges[i]);
    // Minus infinity: nearer than the shortest range (REP 117).
    const bool is_too_near = std::isinf(range_m) && range_m < 0.0;
    if (!is_too_near && !(range_m >= static_cast<double>(message.range_min))) continue;
    const auto max_m = std::min(static_cast<double>(message.range_max), max_length_m);
    const bool has_echo = range_m < max_m;
    const double length_m =
        is_too_near ? static_cast<double>(message.range_min) : std::min(range_m, max_m);
    const double angle_rad = static_cast<double>(message.angle_min) +
                             static_cast<double>(i) * static_cast<double>(message.angle_increment);
    const auto end = base_from_sensor *
                     recordings::ros::Pose{
                         {length_m * std::cos(angle_rad), length_m * std::sin(angle_rad), 0.0}, {}};
    scan.ends.push_back({end.position.x, end.position.y});
    scan.has_echo.push_back(has_echo);
  }
  const std::lock_guard lock(mutex_);
  scan_ = std::move(scan);
}

void ObstacleTopics::receive(const recordings::ros::PointStamped& message) {
  const auto at =
      base_from("contact", message.header.frame_id) * recordings::ros::Pose{message.point, {}};
  const std::lock_guard lock(mutex_);
  contact_ = Point2{at.position.x, at.position.y};
}

std::optional<Point2> ObstacleTopics::take_contact() {
  const std::lock_guard lock(mutex_);
  return std::exchange(contact_, std::nullopt);
}

bool ObstacleTopics::has_scan() const {
  const std::lock_guard lock(mutex_);
  return scan_.has_value();
}

ObstacleTopics::Sensed ObstacleTopics::take(std::int64_t stamp_ns, const Pose2& path_from_camera,
                                            const Pose2& base_from_camera) {
  Sensed sensed;
  if (const auto contact = take_contact()) {
    const Point2 there = inverse(base_from_camera) * *contact;
    sensed.contact_rad = std::atan2(there.y_m, there.x_m);
  }
  std::optional<Scan> scan;
  {
    const std::lock_guard lock(mutex_);
    if (scan_ && std::abs(scan_->stamp_ns - stamp_ns) <= max_age_ns) scan = scan_;
  }
  const auto moved = scan ? motion_.wait_for(scan->stamp_ns) : std::nullopt;
  if (!moved) return sensed;
  const Pose2 camera_from_base = inverse(path_from_camera) * moved->path_from_base;
  std::vector<std::optional<ExplorationReport::Range>> nearest(sectors);
  for (std::size_t i = 0; i < scan->ends.size(); ++i) {
    const Point2 end = camera_from_base * scan->ends[i];
    const double direction_rad = std::atan2(end.y_m, end.x_m);
    const double length_m = std::hypot(end.x_m, end.y_m);
    const double share = 0.5 + direction_rad / (2.0 * std::numbers::pi);
    auto& range = nearest[static_cast<std::size_t>(share * sectors) % sectors];
    if (range && range->length_m <= length_m) continue;
    range = ExplorationReport::Range{direction_rad, length_m, scan->has_echo[i],
                                     range_noise_m + range_noise_factor * length_m};
  }
  for (const auto& range : nearest) {
    if (range) sensed.ranges.push_back(*range);
  }
  return sensed;
}

}  // namespace panonav::ros2
