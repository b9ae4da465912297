#include "panonav_ros2/simulated_robot.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/motion/simulated_base.hpp"

namespace panonav::ros2 {

void visit_options(SimulatedRobotOptions& options, OptionVisitor& visitor) {
  using T = SimulatedRobotOptions;
  constexpr OptionTable table{
      option<&T::picture_rate_hz>("pictures in a second of the simulation", above(0), 100),
      option<&T::odometry_rate_hz>("odometry in a second of the simulation", above(0), 1000),
      option<&T::time_factor>("seconds of the simulation in a second", above(0), 100),
      option<&T::velocity_timeout_s>("after so long without a command the robot stops", above(0),
                                     60),
  };
  table.visit(options, visitor);
}

struct SimulatedRobot::Implementation {
  Implementation(const ParticipantOptions& setup, const SimulatedRobotOptions& wanted,
                 SimulatedSurroundings in, const OdometryNoise& noise, std::uint64_t picture_seed,
                 Participant::Note hears)
      : options((validate(wanted), wanted)),
        surroundings(std::move(in)),
        base(
            surroundings.start, [this](Point2, Point2 to) { return surroundings.is_free(to); },
            noise, picture_seed),
        seed(picture_seed),
        note(std::move(hears)),
        participant(setup, note),
        clocks(participant, "/clock"),
        odometries(participant, "odom", {.depth = 50}),
        transforms(participant, "/tf", {.depth = 100}),
        pictures(participant, "image"),
        truths(participant, "ground_truth", {.depth = 50}) {
    listen<recordings::ros::Twist>("cmd_vel", [this](const recordings::ros::Twist& twist) {
      const Velocity wished{twist.linear.x, twist.linear.y, twist.angular.z};
      if (!std::isfinite(wished.forward_m_s) || !std::isfinite(wished.left_m_s) ||
          !std::isfinite(wished.turn_rad_s)) {
        throw ContractError("velocity", "not finite", "finite numbers");
      }
      velocity = wished;
      velocity_until_s = now_s + options.velocity_timeout_s;
    });
    listen<recordings::ros::PoseStamped>(
        "set_pose", [this](const recordings::ros::PoseStamped& message) {
          const Pose2 wished = recordings::ros::planar(message.pose);
          if (!surroundings.is_free(wished.position())) {
            throw ContractError("place", fixed(wished.x_m, 2) + ", " + fixed(wished.y_m, 2),
                                "a free one");
          }
          const std::lock_guard lock(mutex);
          base.carry_to(wished);
        });
  }

  template <class Message, class Use>
  void listen(const std::string& topic, Use use) {
    participant.subscribe(
        topic, Message::type, {}, [this, topic, use](std::span<const std::uint8_t> cdr) {
          try {
            use(recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr));
          } catch (const Error& error) {
            note("warning: " + topic + ": " + readable_line(error.what()));
          }
        });
  }

  void step(double step_s) {
    now_s += step_s;
    if (now_s > velocity_until_s) velocity = {};
    Pose2 true_move;
    {
      const std::lock_guard lock(mutex);
      true_move = base.drive(velocity, step_s).moved;
    }
    const Pose2& read = base.odometry();
    const std::int64_t ns = std::llround(1e9 * now_s);
    clocks.publish({ns});
    recordings::ros::Odometry message;
    message.header = {ns, "odom"};
    message.child_frame_id = "base_link";
    message.pose.pose = recordings::ros::pose_of(read);
    message.linear_velocity = {true_move.x_m / step_s, true_move.y_m / step_s, 0.0};
    message.angular_velocity = {0.0, 0.0, true_move.heading_rad / step_s};
    odometries.publish(message);
    transforms.publish({{{{ns, "odom"}, "base_link", recordings::ros::pose_of(read)}}});
    truths.publish({{ns, "map"}, recordings::ros::pose_of(base.pose())});
    const std::lock_guard lock(mutex);
    if (now_s >= next_picture_s && !wanted_ns) {
      next_picture_s = std::max(next_picture_s + 1.0 / options.picture_rate_hz, now_s);
      wanted_ns = ns;
      wanted_pose = base.pose();
      wanted.notify_all();
    }
  }

  /// On a thread of its own, so that the world does not stand still for a picture.
  void take_pictures() {
    std::uint64_t number = 0;
    while (true) {
      std::int64_t ns = 0;
      Pose2 at;
      {
        std::unique_lock lock(mutex);
        wanted.wait(lock, [this] { return stopped || wanted_ns; });
        if (stopped) return;
        ns = *wanted_ns;
        at = wanted_pose;
      }
      try {
        const Image seen = surroundings.picture(at, Random(seed, ++number).next());
        const bool grey = seen.channels() == 1;
        const auto width = static_cast<std::uint32_t>(seen.width());
        pictures.publish({{ns, "camera"},
                          static_cast<std::uint32_t>(seen.height()),
                          width,
                          grey ? "mono8" : "rgb8",
                          0,
                          grey ? width : 3 * width,
                          seen.pixels()});
      } catch (const Error& error) {
        note("warning: " + readable_line(error.what()));
      }
      const std::lock_guard lock(mutex);
      wanted_ns.reset();
    }
  }

  void run() {
    using Steady = std::chrono::steady_clock;
    std::thread camera([this] { take_pictures(); });
    const double step_s = 1.0 / options.odometry_rate_hz;
    const auto period = std::chrono::duration_cast<Steady::duration>(
        std::chrono::duration<double>(step_s / options.time_factor));
    auto next = Steady::now();
    while (!stopped) {
      participant.wait(std::max<Steady::duration>(next - Steady::now(), std::chrono::seconds(0)));
      if (Steady::now() < next) continue;
      next = std::max(next + period, Steady::now());
      try {
        step(step_s);
      } catch (const Error& error) {
        note("warning: " + readable_line(error.what()));
      }
    }
    {
      const std::lock_guard lock(mutex);  // the camera waits already, or sees that it may not
    }
    wanted.notify_all();
    camera.join();
  }

  SimulatedRobotOptions options;
  SimulatedSurroundings surroundings;
  SimulatedBase base;  // changed under `mutex`, by the thread of `run` alone
  std::uint64_t seed;
  Participant::Note note;
  Participant participant;
  Publisher<recordings::ros::Clock> clocks;
  Publisher<recordings::ros::Odometry> odometries;
  Publisher<recordings::ros::TFMessage> transforms;
  Publisher<recordings::ros::Image> pictures;
  Publisher<recordings::ros::PoseStamped> truths;
  std::atomic<bool> stopped = false;
  Velocity velocity;
  double now_s = 0.0;
  double velocity_until_s = 0.0;
  double next_picture_s = 0.0;
  std::mutex mutex;  // of what follows
  std::condition_variable wanted;
  std::optional<std::int64_t> wanted_ns;
  Pose2 wanted_pose;
};

SimulatedRobot::SimulatedRobot(const ParticipantOptions& participant,
                               const SimulatedRobotOptions& options,
                               SimulatedSurroundings surroundings, const OdometryNoise& odometry,
                               std::uint64_t seed, Participant::Note note)
    : implementation_(std::make_unique<Implementation>(
          participant, options, std::move(surroundings), odometry, seed, std::move(note))) {}
SimulatedRobot::~SimulatedRobot() = default;

void SimulatedRobot::run() {
  implementation_->run();
}

void SimulatedRobot::stop() {
  implementation_->stopped = true;
  implementation_->participant.wake();
}

}  // namespace panonav::ros2
