#include "panonav_ros2/localisation_node.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_ros2/floor_scan_topic.hpp"
#include "panonav_ros2/goal_driver.hpp"
#include "panonav_ros2/memory_localiser.hpp"
#include "panonav_ros2/obstacle_topics.hpp"
#include "panonav_ros2/sensor_topics.hpp"

namespace panonav::ros2 {

namespace {

using Steady = std::chrono::steady_clock;
using namespace std::chrono_literals;  // NOLINT(google-build-using-namespace)

}  // namespace

struct LocalisationNode::Implementation {
  Implementation(const LocalisationNodeSetup& options, Note note)
      : setup((validate(options.node), options)),
        log(std::move(note)),
        participant(setup.participant, [this](const std::string& line) { log.warn("qos", line); }),
        sensors(participant, setup.node, setup.frames, log, motion, queue),
        obstacles(participant, setup.frames, log, motion),
        driver(participant, setup, log, motion, [this] { return sensors.now_ns(); }),
        localiser(participant, setup, motion, driver, [this] { return sensors.now_ns(); }),
        transforms(participant, "/tf", {.depth = 100}),
        diagnostics(participant, "/diagnostics"),
        answers(participant, "~/command/result") {
    if (setup.teacher) {
      teacher.emplace(setup.memory, *setup.teacher);
    } else if (setup.exploration) {
      if (memory_exists(setup.memory)) {
        throw FileError(setup.memory.string(), "exists; allowed for an exploration: a new file");
      }
      is_memory_unexplored = true;
    } else {
      localiser.load(setup.memory);
      localiser.load_interrupted_mission();
    }
    if (setup.node.camera_height_m > 0.0) {
      floor_scan.emplace(participant, setup.node,
                         setup.teacher ? setup.teacher->pictures
                         : setup.exploration
                             ? setup.exploration->pictures
                             : MemoryFile::open(setup.memory, Access::read_only).header().source);
    }
    subscribe_to_requests();
  }

  void subscribe_to_requests() {
    subscribe<recordings::ros::PoseWithCovarianceStamped>(
        participant, log, "initialpose", {},
        [this](const recordings::ros::PoseWithCovarianceStamped& message) { start_at(message); });
    subscribe<recordings::ros::PoseStamped>(
        participant, log, "goal_pose", {}, [this](const recordings::ros::PoseStamped& goal) {
          require_frame("goal_pose", goal.header.frame_id, setup.frames.map);
          queue.add([this, goal = recordings::ros::to_pose2(goal.pose)] {
            driver.start({.goal = goal});
          });
        });
    subscribe<recordings::ros::String>(
        participant, log, "~/command", {}, [this](const recordings::ros::String& message) {
          queue.add([this, words = message.data] { answers.publish({execute(words)}); });
        });
  }

  void start_at(const recordings::ros::PoseWithCovarianceStamped& message) {
    require_frame("initialpose", message.header.frame_id, setup.frames.map);
    const auto& covariance = message.pose.covariance;
    const double position_m2 = 0.5 * (covariance[0] + covariance[7]);
    const double heading_rad2 = covariance[35];
    if (!(position_m2 >= 0.0 && position_m2 < 1e6 && heading_rad2 >= 0.0 && heading_rad2 < 1e3)) {
      throw ContractError("covariance of x, y and heading",
                          to_text(position_m2) + ", " + to_text(heading_rad2), ">= 0, finite");
    }
    queue.add(
        [this, position_m2, heading_rad2, pose = recordings::ros::to_pose2(message.pose.pose)] {
          localiser.start_at(pose, std::sqrt(position_m2), std::sqrt(heading_rad2));
          motion.set_pose(pose);
        });
  }

  // Runs on the thread that calls `run`.

  void run() {
    std::thread worker([this] { work(); });
    auto next_check = Steady::now() + 1s;
    participant.run(std::chrono::duration<double>(1.0 / setup.node.transform_rate_hz), [&] {
      try {
        send_transform();
        driver.stop_if_silent();
        if (Steady::now() < next_check) return;
        next_check = Steady::now() + 1s;
        check_inputs();
      } catch (const Error& error) {
        log.warn("sending", to_readable_line(error.what()));
      }
    });
    queue.stop();
    motion.stop();
    worker.join();
    driver.end("the node ends");
    if (teacher && teacher->views() > 0) teacher->finish();
  }

  void send_transform() {
    const auto map_from_odom = motion.map_from_odom();
    if (!map_from_odom) return;
    const auto ahead_ns = static_cast<std::int64_t>(1e9 * setup.node.transform_tolerance_s);
    const std::int64_t stamp_ns = sensors.now_ns() + ahead_ns;
    // Send nothing while the clock stands still, because TF does not accept two transforms with the
    // same time.
    if (std::exchange(last_transform_ns, stamp_ns) == stamp_ns) return;
    transforms.publish({{{{stamp_ns, setup.frames.map},
                          setup.frames.odom,
                          recordings::ros::to_pose(*map_from_odom)}}});
  }

  void check_inputs() const {
    sensors.check_publishers();
    if (queue.time_without_picture() < 2s) return;
    recordings::RunMoment moment;
    moment.state = "no images on " + sensors.picture_topic();
    diagnostics.publish(recordings::diagnostics_message(moment, sensors.now_ns()));
  }

  // Runs on the worker thread.

  void work() {
    while (const auto work = queue.next()) {
      try {
        if (work->request) {
          work->request();
        } else {
          observe(work->picture);
        }
      } catch (const Error& error) {
        log.warn("work", (work->request ? "" : sensors.picture_topic() + ": ") +
                             to_readable_line(error.what()));
      }
    }
  }

  void observe(std::span<const std::uint8_t> message) {
    const auto arrival_time = Steady::now();
    auto [observation, stamp_ns, frame] = sensors.decode(message);
    const auto moved = motion.wait_for(stamp_ns);
    if (!moved) {
      log.warn("motion", "no odometry of the time of an image (" + sensors.motion_source() +
                             "); the image is left out");
      return;
    }
    observation.stamp_s = 1e-9 * static_cast<double>(stamp_ns);
    observation.tilt = motion.tilt();
    observation.odometry = moved->path_from_base * setup.node.base_from_camera();
    if (floor_scan) floor_scan->add(observation, stamp_ns, frame);
    recordings::RunMoment moment;
    if (teacher) {
      moment = teach(std::move(observation));
    } else if (is_memory_unexplored) {
      moment = explore(observation, stamp_ns);
    } else {
      if (const auto contact = obstacles.take_contact()) driver.report_contact(*contact);
      moment = localiser.localise(std::move(observation), stamp_ns, *moved);
      if (moment.sure && moment.pose) ++localised;
      const std::chrono::duration<double, std::milli> delay = Steady::now() - arrival_time;
      moment.values.emplace_back("delay_ms", format_fixed(delay.count(), 1));
      moment.values.emplace_back("dropped", std::to_string(queue.dropped()));
      moment.values.emplace_back("warnings", std::to_string(log.count()));
    }
    ++pictures;
    diagnostics.publish(recordings::diagnostics_message(moment, stamp_ns));
  }

  recordings::RunMoment teach(Observation observation) {
    observation.name = "view_" + std::to_string(pictures + 1);
    teacher->add(std::move(observation));
    taught = teacher->views();
    motion.set_map_from_path(teacher->map_from_odometry());
    recordings::RunMoment moment;
    moment.state = "teaching";
    moment.values = {{"views", std::to_string(teacher->views())},
                     {"lines", std::to_string(teacher->lines())}};
    return moment;
  }

  recordings::RunMoment explore(const Observation& observation, std::int64_t stamp_ns) {
    recordings::RunMoment moment;
    if (!driver.has_mission()) {
      moment.state = driver.explorer() == nullptr ? "waiting for the command explore"
                                                  : "the exploration has ended";
      return moment;
    }
    const auto sensed =
        obstacles.take(stamp_ns, observation.odometry.value(), setup.node.base_from_camera());
    driver.explore(observation, {sensed.contact_rad, sensed.ranges});
    const RobotExplorer& robot = *driver.explorer();
    taught = robot.explorer().view_poses().size();
    motion.set_map_from_path(robot.map_from_odometry());
    moment.state = "exploring";
    moment.values = {{"views", std::to_string(taught)}};
    if (!driver.has_mission()) load_explored_memory();
    return moment;
  }

  /// Executes a command from `~/command` and returns the answer.
  std::string execute(const std::string& words) {
    const std::size_t blank = words.find(' ');
    const std::string command = words.substr(0, blank);
    const std::string argument = blank == std::string::npos ? "" : words.substr(blank + 1);
    try {
      if (command == "finish" && teacher) {
        finish_teaching();
      } else if (command == "cancel") {
        const bool was_exploring = is_memory_unexplored && driver.has_mission();
        driver.end("cancelled");
        if (was_exploring) load_explored_memory();
      } else if (teacher) {
        reject_command(words, "finish, because the memory is being made");
      } else if (is_memory_unexplored && command == "explore") {
        driver.start_exploration(obstacles.has_scan());
      } else if (is_memory_unexplored) {
        reject_command(words, "explore, cancel, because the memory is being made");
      } else if (command == "relocalise") {
        localiser.start_globally();
      } else if (command == "repeat" && !argument.empty()) {
        driver.start({.route = argument});
      } else if (command == "return" && !argument.empty()) {
        driver.start({.route = argument, .back = true});
      } else if (command == "add" && !argument.empty()) {
        localiser.add_view(argument);
      } else if (command == "forget" && !argument.empty()) {
        localiser.remove_view(argument);
      } else if (command == "load" && !argument.empty()) {
        localiser.load_neighbour(argument);
      } else {
        reject_command(
            words,
            "relocalise, cancel, repeat ROUTE, return ROUTE, add NAME, forget NAME, load "
            "FILE");
      }
    } catch (const Error& error) {
      return "refused: " + to_readable_line(error.what());
    }
    return command + " done";
  }

  [[noreturn]] static void reject_command(const std::string& words, std::string_view allowed) {
    throw ContractError("command", "'" + to_readable_line(shorten_middle(words, 80)) + "'",
                        allowed);
  }

  void finish_teaching() {
    const Pose2 map_from_path = teacher->finish();
    localiser.load(setup.memory);
    teacher.reset();
    motion.set_map_from_path(map_from_path);
    if (const auto pose = motion.map_from_base()) localiser.start_at(*pose);
  }

  /// Localises the robot in the memory that it has made; where it is lost, globally.
  void load_explored_memory() {
    const RobotExplorer& robot = *driver.explorer();
    if (robot.explorer().view_poses().empty()) throw Error("no view was stored; no memory is made");
    const bool is_lost = robot.state() == ExplorationDecision::State::lost;
    localiser.load(setup.memory);
    is_memory_unexplored = false;
    if (is_lost) {
      motion.set_map_from_path(std::nullopt);
    } else if (const auto pose = motion.map_from_base()) {
      localiser.start_at(*pose);
    }
  }

  const LocalisationNodeSetup setup;
  WarningLog log;
  RobotMotion motion;
  WorkQueue queue;
  Participant participant;
  SensorTopics sensors;
  ObstacleTopics obstacles;
  GoalDriver driver;
  MemoryLocaliser localiser;
  Publisher<recordings::ros::TFMessage> transforms;
  Publisher<recordings::ros::DiagnosticArray> diagnostics;
  Publisher<recordings::ros::String> answers;
  std::optional<FloorScanTopic> floor_scan;  // only by the worker thread
  bool is_memory_unexplored = false;  // an exploration makes it; only used by the worker thread
  std::optional<Teacher> teacher;     // used instead of the localiser; only by the worker thread
  std::atomic<std::size_t> pictures = 0, localised = 0, taught = 0;
  std::int64_t last_transform_ns = 0;
};

LocalisationNode::LocalisationNode(const LocalisationNodeSetup& setup, Note note)
    : implementation_(std::make_unique<Implementation>(setup, std::move(note))) {}
LocalisationNode::~LocalisationNode() = default;

void LocalisationNode::run() {
  implementation_->run();
}

void LocalisationNode::stop() {
  implementation_->participant.stop();
}

LocalisationNode::Counts LocalisationNode::counts() const {
  const Implementation& self = *implementation_;
  return {.pictures = self.pictures,
          .localised = self.localised,
          .dropped = self.queue.dropped(),
          .notes = self.log.count(),
          .taught = self.taught};
}

}  // namespace panonav::ros2
