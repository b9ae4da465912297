#include "panonav_ros2/simulated_robot.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_ros2/work_queue.hpp"
#include "panonav_simulation/simulated_base.hpp"

namespace panonav::ros2 {

void visit_options(SimulatedRobotOptions& options, OptionVisitor& visitor) {
  using T = SimulatedRobotOptions;
  constexpr OptionTable table{
      option<&T::picture_rate_hz>("images per second of simulated time", 0.001, 100),
      option<&T::odometry_rate_hz>("odometry messages per second of simulated time", 0.001, 1000),
      option<&T::time_factor>("simulated seconds per second of real time", 0.001, 100),
      option<&T::velocity_timeout_s>("time without a velocity command after which the robot stops",
                                     0.001, 60),
  };
  table.visit(options, visitor);
}

namespace {

/// Makes a message that refers to the pixels of `picture`, which must outlive it.
recordings::ros::Image make_message(const Image& picture, std::int64_t stamp_ns) {
  const auto width = static_cast<std::uint32_t>(picture.width());
  const bool is_grey = picture.channels() == 1;
  return {{stamp_ns, "camera"},
          static_cast<std::uint32_t>(picture.height()),
          width,
          is_grey ? "mono8" : "rgb8",
          0,
          is_grey ? width : 3 * width,
          picture.pixels()};
}

}  // namespace

struct SimulatedRobot::Implementation {
  Implementation(const ParticipantOptions& setup, const SimulatedRobotOptions& robot,
                 SimulatedSurroundings in, const OdometryNoise& noise, std::uint64_t picture_seed,
                 Note note)
      : options((validate(robot), robot)),
        surroundings(std::move(in)),
        base(
            surroundings.start, [this](Point2, Point2 to) { return surroundings.is_free(to); },
            noise, picture_seed),
        seed(picture_seed),
        log(std::move(note)),
        participant(setup, [this](const std::string& line) { log.warn("qos", line); }),
        clocks(participant, "/clock"),
        odometries(participant, "odom", {.depth = 50}),
        transforms(participant, "/tf", {.depth = 100}),
        pictures(participant, "image"),
        scans(participant, "scan"),
        contacts(participant, "contact"),
        truths(participant, "ground_truth", {.depth = 50}) {
    subscribe<recordings::ros::Twist>(
        participant, log, "cmd_vel", {},
        [this](const recordings::ros::Twist& twist) { set_velocity(twist); });
    subscribe<recordings::ros::PoseStamped>(participant, log, "set_pose", {},
                                            [this](const recordings::ros::PoseStamped& message) {
                                              teleport_to(recordings::ros::to_pose2(message.pose));
                                            });
  }

  void set_velocity(const recordings::ros::Twist& twist) {
    for (const double value : {twist.linear.x, twist.linear.y, twist.angular.z}) {
      if (!std::isfinite(value)) throw ContractError("velocity", "not finite", "finite numbers");
    }
    velocity = {twist.linear.x, twist.linear.y, twist.angular.z};
    velocity_until_s = now_s + options.velocity_timeout_s;
  }

  void teleport_to(const Pose2& pose) {
    if (!surroundings.is_free(pose.position())) {
      throw ContractError("place", format_fixed(pose.x_m, 2) + ", " + format_fixed(pose.y_m, 2),
                          "a free one");
    }
    base.teleport_to(pose);
  }

  void run() {
    std::thread camera([this] {
      while (const auto work = camera_work.next()) work->request();
    });
    const double step_s = 1.0 / options.odometry_rate_hz;
    participant.run(std::chrono::duration<double>(step_s / options.time_factor), [&] {
      try {
        step(step_s);
      } catch (const Error& error) {
        log.warn("step", to_readable_line(error.what()));
      }
    });
    camera_work.stop();
    camera.join();
  }

  void step(double step_s) {
    now_s += step_s;
    if (now_s > velocity_until_s) velocity = {};
    const auto [moved, is_stopped] = base.drive(velocity, step_s);
    const recordings::ros::Pose odom_from_base = recordings::ros::to_pose(base.odometry());
    const std::int64_t stamp_ns = std::llround(1e9 * now_s);
    clocks.publish({stamp_ns});
    recordings::ros::Odometry message;
    message.header = {stamp_ns, "odom"};
    message.child_frame_id = "base_link";
    message.pose.pose = odom_from_base;
    message.linear_velocity = {moved.x_m / step_s, moved.y_m / step_s, 0.0};
    message.angular_velocity = {0.0, 0.0, moved.heading_rad / step_s};
    odometries.publish(message);
    transforms.publish({{{{stamp_ns, "odom"}, "base_link", odom_from_base}}});
    truths.publish({{stamp_ns, "map"}, recordings::ros::to_pose(base.pose())});
    if (is_stopped && (velocity.forward_m_s != 0.0 || velocity.left_m_s != 0.0)) {
      contacts.publish({{stamp_ns, "base_link"}, find_contact_point()});
    }
    if (now_s < next_picture_s || is_taking_picture.exchange(true)) return;
    next_picture_s = std::max(next_picture_s + 1.0 / options.picture_rate_hz, now_s);
    if (surroundings.ranges) publish_scan(stamp_ns);
    camera_work.add([this, stamp_ns, pose = base.pose()] { capture_image(stamp_ns, pose); });
  }

  void publish_scan(std::int64_t stamp_ns) {
    const auto ranges_m = surroundings.ranges(base.pose(), Random(seed, picture_number).next());
    recordings::ros::LaserScan scan{.header = {stamp_ns, "base_link"}};
    scan.angle_increment =
        static_cast<float>(2.0 * std::numbers::pi / static_cast<double>(ranges_m.size()));
    scan.angle_max = scan.angle_increment * static_cast<float>(ranges_m.size() - 1);
    scan.range_max = static_cast<float>(surroundings.max_range_m);
    for (const double range_m : ranges_m) {
      scan.ranges.push_back(range_m < surroundings.max_range_m
                                ? static_cast<float>(range_m)
                                : std::numeric_limits<float>::infinity());
    }
    scans.publish(scan);
  }

  /// Returns the point of the hull in the average direction of those, of eight, in which the robot
  /// cannot move a little; ahead if it can.
  [[nodiscard]] recordings::ros::Vector3 find_contact_point() const {
    constexpr double little_m = 0.03;
    Point2 sum;
    for (int i = 0; i < 8; ++i) {
      const double direction_rad = i * std::numbers::pi / 4.0;
      const Point2 unit{std::cos(direction_rad), std::sin(direction_rad)};
      if (surroundings.is_free(base.pose() * Point2{little_m * unit.x_m, little_m * unit.y_m})) {
        continue;
      }
      sum = {sum.x_m + unit.x_m, sum.y_m + unit.y_m};
    }
    const double length = std::hypot(sum.x_m, sum.y_m);
    const Point2 unit = length > 0.0 ? Point2{sum.x_m / length, sum.y_m / length}
                                     : Point2{velocity.forward_m_s < 0.0 ? -1.0 : 1.0, 0.0};
    return {surroundings.robot_radius_m * unit.x_m, surroundings.robot_radius_m * unit.y_m, 0.0};
  }

  /// Renders an image; runs on a separate thread, so that the simulation does not wait.
  void capture_image(std::int64_t stamp_ns, const Pose2& pose) {
    try {
      const Image picture = surroundings.picture(pose, Random(seed, ++picture_number).next());
      pictures.publish(make_message(picture, stamp_ns));
    } catch (const Error& error) {
      log.warn("picture", to_readable_line(error.what()));
    }
    is_taking_picture = false;
  }

  SimulatedRobotOptions options;
  SimulatedSurroundings surroundings;
  simulation::SimulatedBase base;
  std::uint64_t seed;
  WarningLog log;
  Participant participant;
  Publisher<recordings::ros::Clock> clocks;
  Publisher<recordings::ros::Odometry> odometries;
  Publisher<recordings::ros::TFMessage> transforms;
  Publisher<recordings::ros::Image> pictures;
  Publisher<recordings::ros::LaserScan> scans;
  Publisher<recordings::ros::PointStamped> contacts;
  Publisher<recordings::ros::PoseStamped> truths;
  Velocity velocity;
  double now_s = 0.0;
  double velocity_until_s = 0.0;
  double next_picture_s = 0.0;
  WorkQueue camera_work;
  std::atomic<bool> is_taking_picture = false;
  std::uint64_t picture_number = 0;
};

SimulatedRobot::SimulatedRobot(const ParticipantOptions& participant,
                               const SimulatedRobotOptions& options,
                               SimulatedSurroundings surroundings, const OdometryNoise& odometry,
                               std::uint64_t seed, Note note)
    : implementation_(std::make_unique<Implementation>(
          participant, options, std::move(surroundings), odometry, seed, std::move(note))) {}
SimulatedRobot::~SimulatedRobot() = default;

void SimulatedRobot::run() {
  implementation_->run();
}

void SimulatedRobot::stop() {
  implementation_->participant.stop();
}

}  // namespace panonav::ros2
