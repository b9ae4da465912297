#include "ros2/localisation_node.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/named_view.hpp"
#include "ros2/goal_driver.hpp"
#include "ros2/localisation_topics.hpp"
#include "ros2/sensor_topics.hpp"

namespace panonav::ros2 {

namespace {

using Steady = std::chrono::steady_clock;
using namespace std::chrono_literals;  // NOLINT(google-build-using-namespace)

std::string quoted(const std::string& text) {
  return "'" + readable_line(shortened(text, 80)) + "'";
}

}  // namespace

struct LocalisationNode::Implementation {
  Implementation(const LocalisationNodeSetup& options, Note note)
      : setup((validate(options.node), options)),
        log(std::move(note)),
        participant(options.participant,
                    [this](const std::string& line) { log.warn("qos", line); }),
        sensors(participant, options.node, options.frames, log, motion, queue),
        topics(participant, options.frames),
        driver(participant,
               {options.navigator, options.tracker.source, options.node.command_timeout_s,
                options.node.resume_s, options.frames.map},
               log, motion, [this] { return sensors.now_ns(); }),
        answers(participant, "~/command/result") {
    if (setup.teacher) {
      teacher.emplace(setup.memory, *setup.teacher);
    } else {
      load_memory(setup.memory);
      interrupted = driver.load_interrupted_mission();
    }
    subscribe_to_requests();
  }

  void subscribe_to_requests() {
    subscribe<ros::PoseWithCovarianceStamped>(
        participant, log, "initialpose", {},
        [this](const ros::PoseWithCovarianceStamped& message) { start_at(message); });
    subscribe<ros::PoseStamped>(
        participant, log, "goal_pose", {}, [this](const ros::PoseStamped& goal) {
          require_frame("goal_pose", goal.header.frame_id, setup.frames.map);
          queue.add([this, goal = ros::planar(goal.pose)] { driver.start({.goal = goal}); });
        });
    subscribe<ros::String>(participant, log, "~/command", {}, [this](const ros::String& message) {
      queue.add([this, words = message.data] { answers.publish({execute(words)}); });
    });
  }

  void start_at(const ros::PoseWithCovarianceStamped& message) {
    require_frame("initialpose", message.header.frame_id, setup.frames.map);
    const auto& covariance = message.pose.covariance;
    const double position_m2 = 0.5 * (covariance[0] + covariance[7]);
    const double heading_rad2 = covariance[35];
    if (!(position_m2 >= 0.0 && position_m2 < 1e6 && heading_rad2 >= 0.0 && heading_rad2 < 1e3)) {
      throw ContractError("covariance of x, y and heading",
                          to_text(position_m2) + ", " + to_text(heading_rad2), ">= 0, finite");
    }
    const Pose2 pose = ros::planar(message.pose.pose);
    queue.add(
        [this, pose, position_m = std::sqrt(position_m2), heading_rad = std::sqrt(heading_rad2)] {
          if (!memory) throw Error("the memory is being learnt; allowed: finish, then this");
          memory->tracker.start_at(pose * base_from_camera, position_m, heading_rad);
          motion.set_pose(pose);
        });
  }

  // On the thread of `run`.

  void run() {
    std::thread worker([this] { work(); });
    auto next_check = Steady::now() + 1s;
    participant.run(std::chrono::duration<double>(1.0 / setup.node.transform_rate_hz), [&] {
      try {
        if (const auto map_from_odom = motion.map_from_odom()) {
          const auto ahead_ns = static_cast<std::int64_t>(1e9 * setup.node.transform_tolerance_s);
          topics.send_transform(*map_from_odom, sensors.now_ns() + ahead_ns);
        }
        driver.stop_if_silent();
        if (Steady::now() < next_check) return;
        next_check = Steady::now() + 1s;
        check_inputs();
      } catch (const Error& error) {
        log.warn("sending", readable_line(error.what()));
      }
    });
    queue.stop();
    motion.stop();
    worker.join();
    driver.end("the node ends");
    if (teacher && teacher->views() > 0) teacher->finish();
  }

  void check_inputs() const {
    sensors.check_publishers();
    if (queue.time_without_picture() < 2s) return;
    RunMoment moment;
    moment.state = "no pictures on " + sensors.picture_topic();
    topics.publish_state(moment, sensors.now_ns());
  }

  // On the thread that works.

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
                             readable_line(error.what()));
      }
    }
  }

  void observe(std::span<const std::uint8_t> message) {
    const auto came = Steady::now();
    auto [observation, stamp_ns] = sensors.decode(message);
    const auto moved = motion.wait_for(stamp_ns);
    if (!moved) {
      log.warn("motion", "no odometry of the time of a picture (" + sensors.motion_source() +
                             "); the picture is left out");
      return;
    }
    observation.tilt = motion.tilt();
    observation.odometry = moved->path_from_base * base_from_camera;
    observation.stamp_s = 1e-9 * static_cast<double>(stamp_ns);
    RunMoment moment;
    if (teacher) {
      teach(std::move(observation), moment);
    } else {
      localise(std::move(observation), stamp_ns, *moved, moment);
      const std::chrono::duration<double, std::milli> delay = Steady::now() - came;
      moment.values.emplace_back("delay_ms", fixed(delay.count(), 1));
      moment.values.emplace_back("dropped", std::to_string(queue.dropped()));
      moment.values.emplace_back("warnings", std::to_string(log.count()));
    }
    ++pictures;
    topics.publish_state(moment, stamp_ns);
  }

  void teach(Observation observation, RunMoment& moment) {
    observation.name = "view_" + std::to_string(pictures + 1);
    teacher->add(std::move(observation));
    learnt = teacher->views();
    motion.set_map_from_path(teacher->map_from_odometry());
    moment.state = "learning";
    moment.values = {{"views", std::to_string(teacher->views())},
                     {"lines", std::to_string(teacher->lines())}};
  }

  void localise(Observation observation, std::int64_t stamp_ns, const RobotMotion::Motion& moved,
                RunMoment& moment) {
    if (interrupted) resume(*std::exchange(interrupted, std::nullopt), moved);
    observation.name = sensors.picture_topic();
    Tracker& tracker = memory->tracker;
    tracker.move_to(*observation.odometry);
    const PackedSignature view = tracker.encoder().packed(observation);
    MonteCarloEstimate estimate = tracker.observe(view);
    last_pose = estimate.pose;
    if (estimate.pose) estimate.pose = *estimate.pose * inverse(base_from_camera);
    describe(moment, estimate);
    if (moment.sure && estimate.pose) {
      correct_motion(*estimate.pose, moved.path_from_base, moment);
    } else {
      last_pose.reset();
    }
    driver.drive(observation, last_pose);
    last_observation = std::move(observation);
    topics.publish_estimate(moment, stamp_ns, *memory, view);
    if (last_pose) ++localised;
  }

  void correct_motion(const Pose2& map_from_base, const Pose2& path_from_base, RunMoment& moment) {
    const auto former = motion.set_map_from_path(map_from_base * inverse(path_from_base));
    if (!former) return;
    const Pose2 before = *former * path_from_base;
    moment.values.emplace_back("correction_m",
                               fixed(distance(before.position(), map_from_base.position()), 4));
    moment.values.emplace_back(
        "correction_rad",
        fixed(std::abs(angle_difference(before.heading_rad, map_from_base.heading_rad)), 4));
  }

  void resume(const Mission& mission, const RobotMotion::Motion& now) {
    const Pose2 pose = mission.map_from_odom * now.odom_from_base;
    start_tracker_at(pose * base_from_camera);
    motion.set_map_from_path(pose * inverse(now.path_from_base));
    driver.start(mission);
  }

  /// Executes a command of `~/command`, and returns the answer.
  std::string execute(const std::string& words) {
    using Command = std::function<void(const std::string& argument)>;
    const std::map<std::string, Command> with_argument{
        {"repeat", [this](const std::string& route) { driver.start({.route = route}); }},
        {"learn", [this](const std::string& name) { add_view(name); }},
        {"forget", [this](const std::string& name) { remove_view(name); }},
        {"load", [this](const std::string& path) { load_neighbour(path); }}};
    const std::size_t blank = words.find(' ');
    const std::string command = words.substr(0, blank);
    const std::string argument = blank == std::string::npos ? "" : words.substr(blank + 1);
    try {
      if (command == "finish" && teacher) {
        finish_teaching();
      } else if (command == "cancel") {
        driver.end("cancelled");
      } else if (teacher) {
        throw ContractError("command", quoted(words), "finish, as the memory is being learnt");
      } else if (command == "relocalise") {
        memory->tracker.start_anywhere();
      } else if (const auto found = with_argument.find(command);
                 found != with_argument.end() && !argument.empty()) {
        found->second(argument);
      } else {
        throw ContractError("command", quoted(words),
                            "relocalise, cancel, repeat ROUTE, learn NAME, forget NAME, load FILE");
      }
    } catch (const Error& error) {
      return "refused: " + readable_line(error.what());
    }
    return command + " done";
  }

  void finish_teaching() {
    const Pose2 map_from_path = teacher->finish();
    load_memory(setup.memory);
    teacher.reset();
    motion.set_map_from_path(map_from_path);
    if (const auto pose = motion.map_from_base()) start_tracker_at(*pose * base_from_camera);
  }

  /// Adds the last picture to the memory.
  void add_view(const std::string& name) {
    if (!last_observation || !last_pose) {
      throw Error("the robot is not localised, so a view of this place has no position");
    }
    last_observation->pose = ReferencePose{last_pose->x_m, last_pose->y_m, last_pose->heading_rad};
    last_observation->name = name;
    Memoriser memoriser(setup.memory, {.source = setup.tracker.source});
    memoriser.add(*last_observation);
    memoriser.finish();
    reload_memory();
  }

  void remove_view(const std::string& name) {
    MemoryFile writable = MemoryFile::open(setup.memory, Access::read_write);
    const ViewId view = named_view(writable, name);
    writable.remove({&view, 1});
    reload_memory();
  }

  /// Loads another memory of the same folder: who may write to a topic may not open any file that
  /// the node may read.
  void load_neighbour(const std::string& name) {
    namespace fs = std::filesystem;
    std::error_code code;
    const fs::path folder = fs::weakly_canonical(fs::absolute(setup.memory), code).parent_path();
    const fs::path path = fs::weakly_canonical(folder / name, code);
    if (code || path.parent_path() != folder) {
      throw ContractError("file to load", quoted(name),
                          "the name of a file in the folder of the memory");
    }
    load_memory(path);
    motion.set_map_from_path(std::nullopt);  // it was in the frame of the other memory
  }

  /// Loads the memory again, with the robot where it is.
  void reload_memory() {
    const auto pose = last_pose;
    load_memory(setup.memory);
    if (pose) start_tracker_at(*pose);
  }

  /// If this throws, the memory stays as it is.
  void load_memory(const std::filesystem::path& path) {
    MemoryFile file = MemoryFile::open(path, Access::read_only);
    Tracker tracker(file, setup.tracker);
    std::unique_ptr<LoadedMemory> loaded(
        new LoadedMemory{path, std::move(file), std::move(tracker)});
    driver.set_memory(*loaded);
    memory = std::move(loaded);
    setup.memory = path;
    last_observation.reset();
    last_pose.reset();
    topics.publish_references(memory->tracker.memory(), sensors.now_ns());
  }

  void start_tracker_at(const Pose2& map_from_camera) {
    constexpr double heading_deviation_rad = 0.1;  // of a pose that was found or carried on
    memory->tracker.start_at(map_from_camera, 0.5 * memory->tracker.localiser().model().spacing_m,
                             heading_deviation_rad);
  }

  LocalisationNodeSetup setup;
  WarningLog log;
  RobotMotion motion;
  WorkQueue queue;
  Participant participant;
  SensorTopics sensors;
  LocalisationTopics topics;  // transforms and states on the thread of `run`
  GoalDriver driver;
  Publisher<ros::String> answers;
  std::atomic<std::size_t> pictures = 0, localised = 0, learnt = 0;

  // Of the thread that works: either a teacher, or a memory that it localises by.
  std::optional<Teacher> teacher;
  std::unique_ptr<LoadedMemory> memory;
  const Pose2 base_from_camera{setup.node.camera_x_m, setup.node.camera_y_m, 0.0};
  std::optional<Mission> interrupted;  // until the first picture
  std::optional<Observation> last_observation;
  std::optional<Pose2> last_pose;  // of the camera in the map; `nullopt`: not localised by it
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
          .learnt = self.learnt};
}

}  // namespace panonav::ros2
