#include "ros2/localisation_node.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/named_view.hpp"
#include "panonav/pipeline/route_driver.hpp"
#include "panonav/pipeline/run_messages.hpp"
#include "ros2/motion_history.hpp"

namespace panonav::ros2 {

namespace {

using Steady = std::chrono::steady_clock;
using namespace std::chrono_literals;  // NOLINT(google-build-using-namespace)
using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t second_ns = 1'000'000'000;

std::int64_t system_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Particles that are shown: of thousands, no more tell a person more.
constexpr std::size_t shown_particles = 500;

}  // namespace

void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor) {
  using T = LocalisationNodeOptions;
  constexpr OptionTable table{
      choice<&T::motion>("where motion is read: the topic odom, or TF", "odometry", "tf"),
      choice<&T::pictures>("the topic image, or image/compressed", "raw", "compressed"),
      option<&T::transform_tolerance_s>("how far the transform is dated ahead", 0, 60),
      option<&T::transform_rate_hz>("how often the transform is sent", above(0), 1000),
      option<&T::use_sim_time>("time is what the topic /clock says"),
      option<&T::tilt_from_imu>("level pictures by the orientation on the topic imu"),
      option<&T::command_timeout_s>("without a picture for so long a robot that is driven stops",
                                    above(0), 60),
      option<&T::resume_s>("a node that died and is started again within so long goes on with the "
                           "goal it had; 0: never",
                           0, 86400),
      option<&T::camera_x_m>("camera in front of the base frame's origin", -10, 10),
      option<&T::camera_y_m>("and to its left", -10, 10),
  };
  table.visit(options, visitor);
}

struct RareNotes::State {
  struct Kind {
    Steady::time_point said;
    std::size_t kept = 0;  // since then
  };
  Note note;
  mutable std::mutex mutex;
  std::map<std::string, Kind, std::less<>> kinds;
  std::size_t count = 0;
};

RareNotes::RareNotes(Note note) : state_(std::make_unique<State>()) {
  state_->note = std::move(note);
}
RareNotes::~RareNotes() = default;

void RareNotes::say(std::string_view kind, const std::string& line) {
  constexpr auto between = 10s;
  const std::lock_guard lock(state_->mutex);
  ++state_->count;
  const auto now = Steady::now();
  const auto found = state_->kinds.find(kind);
  if (found != state_->kinds.end() && now - found->second.said < between) {
    ++found->second.kept;
    return;
  }
  const std::size_t kept = found == state_->kinds.end() ? 0 : found->second.kept;
  state_->kinds.insert_or_assign(std::string(kind), State::Kind{now, 0});
  state_->note("warning: " + line +
               (kept > 0 ? " (and " + std::to_string(kept) + " times before)" : ""));
}

std::size_t RareNotes::count() const {
  const std::lock_guard lock(state_->mutex);
  return state_->count;
}

struct LocalisationNode::Implementation {
  using Job = std::function<void()>;

  Implementation(const LocalisationNodeSetup& wanted, RareNotes::Note note)
      : setup(wanted),
        options(wanted.node),
        notes(std::move(note)),
        participant(wanted.participant,
                    [this](const std::string& line) { notes.say("qos", line); }),
        transforms(participant, "/tf", {.depth = 100}),
        poses(participant, "~/pose", {.depth = 1, .transient_local = true}),
        particles(participant, "~/particles"),
        references(participant, "~/references", {.depth = 1, .transient_local = true}),
        areas(participant, "~/areas", {.depth = 1, .transient_local = true}),
        best_matches(participant, "~/best_match/compressed"),
        diagnostics(participant, "/diagnostics"),
        velocities(participant, "cmd_vel", {.depth = 1}),
        feedback(participant, "~/goal/feedback"),
        results(participant, "~/goal/result"),
        answers(participant, "~/command/result") {
    validate(options);
    if (setup.teacher) {
      teacher.emplace(setup.memory, *setup.teacher);
    } else {
      localise_by(setup.memory);
      resumed = mission_to_resume();
    }
    subscribe();
  }

  // What comes: on the thread of `run`.

  template <class Message, class Use>
  void listen(const std::string& topic, const Qos& qos, Use use) {
    participant.subscribe(topic, Message::type, qos,
                          [this, topic, use](std::span<const std::uint8_t> cdr) {
                            try {
                              use(ros::read_message<Message>(cdr, MessageEncoding::cdr), cdr);
                            } catch (const Error& error) {
                              notes.say(topic, topic + ": " + readable_line(error.what()));
                            }
                          });
  }

  void subscribe() {
    constexpr int sensor_depth = 50;
    if (options.use_sim_time) {
      listen<ros::Clock>("/clock", {.depth = 10, .reliable = false},
                         [this](const ros::Clock& clock, auto&&) { sim_ns = clock.clock_ns; });
    }
    if (options.motion == MotionInput::odometry) {
      listen<ros::Odometry>("odom", {.depth = sensor_depth},
                            [this](const ros::Odometry& odometry, auto&&) { take(odometry); });
    } else {
      const auto use = [this](const ros::TFMessage& message, auto&&) { take(message); };
      listen<ros::TFMessage>("/tf", {.depth = 100}, use);
      listen<ros::TFMessage>("/tf_static", {.depth = 100, .transient_local = true}, use);
    }
    if (options.tilt_from_imu) {
      listen<ros::Imu>("imu", {.depth = sensor_depth},
                       [this](const ros::Imu& imu, auto&&) { take(imu); });
    }
    const auto keep = [this](const auto& message, std::span<const std::uint8_t> cdr) {
      keep_picture(message.header.stamp_ns, cdr);
    };
    if (options.pictures == PictureInput::raw) {
      listen<ros::Image>(picture_topic(), {}, keep);
    } else {
      listen<ros::CompressedImage>(picture_topic(), {}, keep);
    }
    listen<ros::PoseWithCovarianceStamped>(
        "initialpose", {},
        [this](const ros::PoseWithCovarianceStamped& pose, auto&&) { start_at(pose); });
    listen<ros::PoseStamped>("goal_pose", {}, [this](const ros::PoseStamped& goal, auto&&) {
      require_frame("goal_pose", goal.header.frame_id, setup.frames.map);
      add_job([this, goal = ros::planar(goal.pose)] { set_out({.goal = goal}); });
    });
    listen<ros::String>("~/command", {}, [this](const ros::String& message, auto&&) {
      add_job([this, words = message.data] { answer(words); });
    });
  }

  [[nodiscard]] std::string picture_topic() const {
    return options.pictures == PictureInput::raw ? "image" : "image/compressed";
  }

  void require_frame(const std::string& topic, const std::string& frame,
                     const std::string& wanted) {
    if (frame == wanted) return;
    throw ContractError("frame of the message", "'" + readable_line(shortened(frame, 60)) + "'",
                        wanted + ", as the parameters name it for " + topic);
  }

  void add_motion(const std::string& topic, std::int64_t stamp_ns, const ros::Pose& pose) {
    MotionHistory::Added added{};
    {
      const std::lock_guard lock(mutex);
      added = motion.add(stamp_ns, ros::planar(pose));
    }
    changed.notify_all();
    if (added == MotionHistory::Added::late) {
      notes.say("order of " + topic,
                topic + ": a stamp is not after the one before it; the message is left out");
    } else if (added == MotionHistory::Added::restarted) {
      notes.say("start of " + topic,
                topic + ": the motion begins anew, elsewhere or at an earlier time");
    }
  }

  void take(const ros::Odometry& odometry) {
    require_frame("odom", odometry.header.frame_id, setup.frames.odom);
    require_frame("odom", odometry.child_frame_id, setup.frames.base);
    add_motion("odom", odometry.header.stamp_ns, odometry.pose.pose);
  }

  void take(const ros::TFMessage& message) {
    std::optional<std::int64_t> stamp_ns;
    for (const ros::TransformStamped& each : message.transforms) {
      if (each.child_frame_id == setup.frames.odom) continue;  // what we say ourselves
      frames.set(each);
      if (each.header.stamp_ns > 0) stamp_ns = std::max(stamp_ns.value_or(0), each.header.stamp_ns);
    }
    const auto odom_from_base = frames.lookup(setup.frames.odom, setup.frames.base);
    if (!odom_from_base || !stamp_ns) return;
    const auto before = motion.newest_ns();  // only this thread adds
    // Transforms that others send meanwhile, of wheels, say, bring no news of the base.
    if (last_transform && before && *stamp_ns <= *before) return;
    last_transform = odom_from_base;
    add_motion("/tf", *stamp_ns, *odom_from_base);
  }

  void take(const ros::Imu& imu) {
    if (imu.orientation_covariance[0] == -1.0) {
      throw ContractError("orientation_covariance[0]", -1.0,
                          "another value: the sensor must state an orientation");
    }
    const Tilt now = ros::tilt_of(imu.orientation);
    if (!std::isfinite(now.roll_rad) || !std::isfinite(now.pitch_rad)) {
      throw ContractError("orientation", "not finite", "a unit quaternion");
    }
    const std::lock_guard lock(mutex);
    tilt = now;
  }

  void keep_picture(std::int64_t stamp_ns, std::span<const std::uint8_t> cdr) {
    const std::lock_guard lock(mutex);
    if (last_picture_ns && stamp_ns <= *last_picture_ns &&
        stamp_ns > *last_picture_ns - MotionHistory::late_ns) {
      notes.say("order of pictures", picture_topic() +
                                         ": a stamp is not after the one before it; the picture "
                                         "is left out");
      return;
    }
    last_picture_ns = stamp_ns;
    last_picture_came = Steady::now();
    if (picture) ++counts.dropped;
    picture.emplace(cdr.begin(), cdr.end());
    changed.notify_all();
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
    add_job(
        [this, pose, position_m = std::sqrt(position_m2), heading_rad = std::sqrt(heading_rad2)] {
          require_memory();
          tracker->start_at(pose * base_from_camera, position_m, heading_rad);
          const std::lock_guard lock(mutex);
          if (const auto now = motion.newest()) map_from_path = pose * inverse(now->path_from_base);
        });
  }

  void add_job(Job job) {
    constexpr std::size_t max_jobs = 16;
    const std::lock_guard lock(mutex);
    if (jobs.size() >= max_jobs) throw Error("too many requests at a time; this one is left out");
    jobs.push_back(std::move(job));
    changed.notify_all();
  }

  // What goes out at a rate, on the same thread.

  [[nodiscard]] std::int64_t now_ns() const {
    return options.use_sim_time ? sim_ns.load() : system_ns();
  }

  void send_transform() {
    std::optional<Pose2> map_from_odom;
    {
      const std::lock_guard lock(mutex);
      const auto now = motion.newest();
      if (!map_from_path || !now) return;
      map_from_odom = *map_from_path * now->path_from_base * inverse(now->odom_from_base);
    }
    const auto ahead = static_cast<std::int64_t>(options.transform_tolerance_s * second_ns);
    const std::int64_t stamp_ns = now_ns() + ahead;
    if (stamp_ns == last_transform_ns) return;  // a clock that stands: TF wants no two of a time
    last_transform_ns = stamp_ns;
    transforms.publish(
        {{{{stamp_ns, setup.frames.map}, setup.frames.odom, ros::pose_of(*map_from_odom)}}});
  }

  void watch() {
    for (const std::string& topic :
         {picture_topic(),
          std::string(options.motion == MotionInput::odometry ? "odom" : "initialpose")}) {
      const std::size_t publishers = participant.publishers(topic);
      if (publishers > 1 && topic != "initialpose") {
        notes.say("publishers of " + topic, topic + " has " + std::to_string(publishers) +
                                                " publishers; one is expected, all are heard");
      }
    }
    bool silent = false;
    {
      const std::lock_guard lock(mutex);
      silent = Steady::now() - last_picture_came > 2s;
    }
    if (silent) {
      RunMoment moment;
      moment.state = "no pictures on " + picture_topic();
      diagnostics.publish(diagnostics_message(moment, now_ns()));
    }
  }

  void run() {
    std::thread worker([this] { look(); });
    const auto period = std::chrono::duration_cast<Steady::duration>(
        std::chrono::duration<double>(1.0 / options.transform_rate_hz));
    auto next = Steady::now();
    auto next_watch = next + 1s;
    while (!stopped) {
      participant.wait(std::max<Steady::duration>(next - Steady::now(), 0ns));
      const auto now = Steady::now();
      if (now < next) continue;
      next = std::max(next + period, now);
      try {
        send_transform();
        watch_command();
        if (now < next_watch) continue;
        next_watch = now + 1s;
        watch();
      } catch (const Error& error) {
        notes.say("sending", readable_line(error.what()));
      }
    }
    {
      const std::lock_guard lock(mutex);  // the worker waits already, or sees that it may not
    }
    changed.notify_all();
    worker.join();
    end_way("the node ends");
    if (teacher && teacher->views() > 0) teacher->finish();
  }

  // What looks at pictures, on a thread of its own.

  void look() {
    while (true) {
      Job job;
      Bytes message;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return stopped || picture || !jobs.empty(); });
        if (stopped) return;
        if (!jobs.empty()) {
          job = std::move(jobs.front());
          jobs.pop_front();
        } else {
          message = std::move(*picture);
          picture.reset();
        }
      }
      try {
        if (job) {
          job();
        } else {
          observe(message);
        }
      } catch (const Error& error) {
        notes.say("work", (job ? "" : picture_topic() + ": ") + readable_line(error.what()));
      }
    }
  }

  /// Odometry of the time of the picture may still be on its way. Empty when it does not come: then
  /// the picture cannot be placed.
  std::optional<MotionHistory::Motion> motion_at(std::int64_t stamp_ns) {
    std::unique_lock lock(mutex);
    std::optional<MotionHistory::Motion> found;
    changed.wait_for(lock, 300ms, [&] {
      found = motion.at(stamp_ns);
      return stopped || found || (motion.newest_ns() && *motion.newest_ns() >= stamp_ns);
    });
    return found;
  }

  void observe(const Bytes& message) {
    const auto came = Steady::now();
    std::int64_t stamp_ns = 0;
    Observation seen = [&]() -> Observation {
      if (options.pictures == PictureInput::raw) {
        const auto read = ros::read_message<ros::Image>(message, MessageEncoding::cdr);
        stamp_ns = read.header.stamp_ns;
        return ros::picture_of(read);
      }
      const auto read = ros::read_message<ros::CompressedImage>(message, MessageEncoding::cdr);
      stamp_ns = read.header.stamp_ns;
      return ros::picture_of(read, picture_topic());
    }();
    seen.name = picture_topic();
    const auto moved = motion_at(stamp_ns);
    if (!moved) {
      notes.say("motion",
                "no odometry of the time of a picture (" +
                    std::string(options.motion == MotionInput::odometry
                                    ? "topic odom"
                                    : "TF from " + setup.frames.odom + " to " + setup.frames.base) +
                    "); the picture is left out");
      return;
    }
    {
      const std::lock_guard lock(mutex);
      seen.tilt = tilt;
    }
    seen.odometry = moved->path_from_base * base_from_camera;
    seen.stamp_s = 1e-9 * static_cast<double>(stamp_ns);
    if (teacher) {
      teach(std::move(seen), stamp_ns);
      return;
    }
    if (resumed) resume(*std::exchange(resumed, std::nullopt), *moved);
    tracker->move_to(*seen.odometry);
    const PackedSignature view = tracker->encoder().packed(seen);
    MonteCarloEstimate estimate = tracker->observe(view);

    RunMoment moment;
    last_pose = estimate.pose;  // of the camera, as the memory has it
    if (estimate.pose) estimate.pose = *estimate.pose * inverse(base_from_camera);
    describe(moment, estimate);
    const bool localised = moment.sure && estimate.pose;
    if (!localised) last_pose.reset();
    if (localised) {
      const Pose2 corrected = *estimate.pose * inverse(moved->path_from_base);
      const std::lock_guard lock(mutex);
      if (map_from_path) {
        const Pose2 before = *map_from_path * moved->path_from_base;
        moment.values.emplace_back(
            "correction_m", fixed(distance(before.position(), estimate.pose->position()), 4));
        moment.values.emplace_back(
            "correction_rad",
            fixed(std::abs(angle_difference(before.heading_rad, estimate.pose->heading_rad)), 4));
      }
      map_from_path = corrected;
    }
    drive(seen);
    last_seen = std::move(seen);
    if (localised) poses.publish(pose_message(moment, stamp_ns, setup.frames.map));
    if (particles.subscribers() > 0) {
      moment.particles = resample_systematically(tracker->localiser().particles(), shown_particles);
      particles.publish(poses_message(moment.particles, stamp_ns, setup.frames.map));
    }
    if (best_matches.subscribers() > 0) {
      const auto found = tracker->memory().search(view, {.top = 1});
      const auto thumbnail = file->thumbnail(found.matches.front().view);
      if (thumbnail) best_matches.publish({{stamp_ns, setup.frames.base}, "png", *thumbnail});
    }
    moment.values.emplace_back(
        "delay_ms",
        fixed(std::chrono::duration<double, std::milli>(Steady::now() - came).count(), 1));
    {
      const std::lock_guard lock(mutex);
      ++counts.pictures;
      if (localised) ++counts.localised;
      moment.values.emplace_back("dropped", std::to_string(counts.dropped));
    }
    moment.values.emplace_back("warnings", std::to_string(notes.count()));
    diagnostics.publish(diagnostics_message(moment, stamp_ns));
  }

  void teach(Observation seen, std::int64_t stamp_ns) {
    seen.name = "view_" + std::to_string(++taught);
    teacher->add(std::move(seen));
    RunMoment moment;
    moment.state = "learning";
    moment.values = {{"views", std::to_string(teacher->views())},
                     {"lines", std::to_string(teacher->lines())}};
    {
      const std::lock_guard lock(mutex);
      ++counts.pictures;
      counts.learnt = teacher->views();
      map_from_path = teacher->map_from_odometry();
    }
    diagnostics.publish(diagnostics_message(moment, stamp_ns));
  }

  void require_memory() const {
    if (!tracker) throw Error("the memory is being learnt; allowed: finish, then this");
  }

  // Ways to a goal, on the same thread.

  /// What the robot was sent to: a place, or along a route.
  struct Mission {
    std::optional<Pose2> goal;
    std::string route;
    // Of the route, when the file was written, as the next: where the robot was on it, and what was
    // learnt of it, which takes a second.
    std::optional<double> along_m = {};
    double min_correlation = 0.0;
    Pose2 map_from_odom = {};
  };

  [[nodiscard]] std::filesystem::path mission_file() const {
    return setup.memory.string() + ".mission";
  }

  /// Once a second, so that its time of change tells when the node died.
  void keep_mission() {
    if (options.resume_s <= 0.0 || Steady::now() - mission_kept < 1s) return;
    mission_kept = Steady::now();
    const auto words = [](const Pose2& pose) {
      return to_text(pose.x_m) + " " + to_text(pose.y_m) + " " + to_text(pose.heading_rad) + "\n";
    };
    Pose2 map_from_odom;
    {
      const std::lock_guard lock(mutex);
      const auto now = motion.newest();
      if (!map_from_path || !now) return;
      map_from_odom = *map_from_path * now->path_from_base * inverse(now->odom_from_base);
    }
    std::string what = "repeat " + to_text(mission.along_m.value_or(0.0)) + " " +
                       to_text(mission.min_correlation) + " " + mission.route;
    if (mission.goal) what = "goal " + words(*mission.goal);
    write_file(mission_file(), words(map_from_odom) + what);
  }

  void forget_mission() const {
    std::error_code ignored;
    std::filesystem::remove(mission_file(), ignored);
  }

  /// Empty where there is none, or none of a node that died just now.
  std::optional<Mission> mission_to_resume() {
    namespace fs = std::filesystem;
    std::error_code code;
    const auto written = fs::last_write_time(mission_file(), code);
    if (code) return std::nullopt;
    const double age_s =
        std::chrono::duration<double>(fs::file_time_type::clock::now() - written).count();
    std::ifstream in(mission_file());
    Mission read;
    std::string word;
    Pose2& frame = read.map_from_odom;
    Pose2 goal;
    in >> frame.x_m >> frame.y_m >> frame.heading_rad >> word;
    if (word == "goal") {
      in >> goal.x_m >> goal.y_m >> goal.heading_rad;
      read.goal = goal;
    } else {
      double along_m = 0.0;
      in >> along_m >> read.min_correlation >> std::ws;
      read.along_m = along_m;
      std::getline(in, read.route);
    }
    const bool whole = in && (read.goal || (word == "repeat" && !read.route.empty()));
    if (!whole || age_s > options.resume_s) {
      notes.say("mission", mission_file().string() +
                               (whole ? " is " + fixed(age_s, 0) + " s old" : " is damaged") +
                               "; the robot is not sent on");
      forget_mission();
      return std::nullopt;
    }
    return read;
  }

  void resume(const Mission& wanted, const MotionHistory::Motion& now) {
    const Pose2 here = wanted.map_from_odom * now.odom_from_base;
    tracker->start_at(here * base_from_camera, 0.5 * tracker->localiser().model().spacing_m, 0.1);
    {
      const std::lock_guard lock(mutex);
      map_from_path = here * inverse(now.path_from_base);
    }
    set_out(wanted);
  }

  /// There is one: no tracker is made of a memory without positions.
  [[nodiscard]] ViewId nearest_view(Point2 place) const {
    const VisualMemory& memory = tracker->memory();
    std::optional<std::pair<double, ViewId>> nearest;
    for (const ViewId view : memory.views()) {
      const auto& pose = memory.info(view).pose;
      if (!pose) continue;
      const double off_m = distance(pose->position(), place);
      if (!nearest || off_m < nearest->first) nearest.emplace(off_m, view);
    }
    return nearest.value().second;
  }

  void set_out(const Mission& wanted) {
    end_way("another goal");
    try {
      require_memory();
      driver.reset();
      if (!wanted.goal) {
        RouteDriverOptions along{.follower = {.name = wanted.route, .tracker = {}, .fit = {}},
                                 .base = setup.navigator.base,
                                 .resume_m = wanted.along_m};
        along.follower.tracker.min_correlation = wanted.min_correlation;
        driver.emplace(*file, setup.tracker.source, along);
      } else {
        const std::string name = tracker->memory().info(nearest_view(wanted.goal->position())).name;
        if (navigator) {
          navigator->set_goal(name);
        } else {
          navigator.emplace(setup.memory, name, setup.navigator);
          publish_areas();
        }
      }
    } catch (const Error& error) {
      forget_mission();
      results.publish(way_message(2, std::string("refused: ") + error.what(), {}));
      throw;
    }
    mission = wanted;
    if (driver) mission.min_correlation = driver->follower().tracker().min_correlation();
    mission_kept = {};
    const std::lock_guard lock(command_mutex);
    driving = true;
    last_command = Steady::now();
  }

  [[nodiscard]] ros::DiagnosticArray way_message(std::uint8_t level, const std::string& state,
                                                 std::vector<ros::KeyValue> values) const {
    return {{now_ns(), setup.frames.map},
            {{level, "panonav: goal", readable_line(state), {}, std::move(values)}}};
  }

  /// The robot stands, and whoever sent it hears why. Nothing where it is not under way.
  void end_way(const std::string& why, std::uint8_t level = 1) {
    {
      const std::lock_guard lock(command_mutex);
      if (!driving) return;
      driving = false;
      velocities.publish({});
    }
    forget_mission();
    results.publish(way_message(level, why, {}));
  }

  void drive(const Observation& seen) {
    if (!is_driving()) return;
    keep_mission();
    if (driver) {
      drive_along(seen);
      return;
    }
    RobotReport report;
    if (last_pose) report.estimate = nearest_view(last_pose->position());
    const NavigationStep step = navigator->step(seen, report);
    const NavigationDecision& decision = step.decision;
    if (decision.state != NavigationState::moving) {
      end_way(std::string(name_of(decision.state)),
              decision.state == NavigationState::arrived ? 0 : 2);
      return;
    }
    command(step.velocity);
    if (!step.decided) return;
    feedback.publish(way_message(
        0, std::string(name_of(decision.state)),
        {{"way", fixed(decision.way, 3)},
         {"probability", fixed(decision.probability, 4)},
         {"nearest", decision.nearest ? navigator->info(*decision.nearest).name : std::string()}}));
  }

  void drive_along(const Observation& seen) {
    const RouteDriveStep step = driver->step(seen, last_pose);
    mission.along_m = step.along_m;
    const std::string state(name_of(step.state));
    if (step.state == RouteDriveState::arrived || step.state == RouteDriveState::lost) {
      end_way(state, step.state == RouteDriveState::arrived ? 0 : 2);
      return;
    }
    command(step.velocity);
    std::vector<ros::KeyValue> values{{"along_m", fixed(step.along_m, 3)},
                                      {"length_m", fixed(step.length_m, 3)}};
    if (step.fix) values.push_back({"lateral_m", fixed(step.fix->lateral_m, 3)});
    feedback.publish(way_message(0, state, std::move(values)));
  }

  void command(const Velocity& velocity) {
    const std::lock_guard lock(command_mutex);
    velocities.publish(
        {{velocity.forward_m_s, velocity.left_m_s, 0.0}, {0.0, 0.0, velocity.turn_rad_s}});
    last_command = Steady::now();
  }

  [[nodiscard]] bool is_driving() const {
    const std::lock_guard lock(command_mutex);
    return driving;
  }

  /// The dead man's handle, on the thread of `run`: whatever holds up pictures, the robot stops.
  void watch_command() {
    const std::lock_guard lock(command_mutex);
    if (!driving ||
        Steady::now() - last_command < std::chrono::duration<double>(options.command_timeout_s)) {
      return;
    }
    velocities.publish({});
    last_command = Steady::now();
    notes.say("command", "no picture for " + fixed(options.command_timeout_s, 2) +
                             " s; the robot is stopped until one comes");
  }

  // What users ask for, on the thread that looks.

  void answer(const std::string& words) {
    const std::size_t blank = words.find(' ');
    const std::string word = words.substr(0, blank);
    const std::string rest = blank == std::string::npos ? "" : words.substr(blank + 1);
    std::string said = word + " done";
    try {
      if (word == "finish" && teacher) {
        finish_teaching();
      } else if (word == "cancel") {
        end_way("cancelled");
      } else if (teacher) {
        throw ContractError("command", "'" + readable_line(shortened(words, 80)) + "'",
                            "finish, as the memory is being learnt");
      } else if (word == "relocalise") {
        tracker->start_anywhere();
      } else if (word == "repeat" && !rest.empty()) {
        set_out({.route = rest});
      } else if (word == "learn" && !rest.empty()) {
        learn(rest);
      } else if (word == "forget" && !rest.empty()) {
        forget(rest);
      } else if (word == "load" && !rest.empty()) {
        load(rest);
      } else {
        throw ContractError("command", "'" + readable_line(shortened(words, 80)) + "'",
                            "relocalise, cancel, repeat ROUTE, learn NAME, forget NAME, load FILE");
      }
    } catch (const Error& error) {
      said = "refused: " + readable_line(error.what());
    }
    answers.publish({said});
  }

  void finish_teaching() {
    const Pose2 map_from_odometry = teacher->finish();
    localise_by(setup.memory);
    teacher.reset();
    const std::lock_guard lock(mutex);
    map_from_path = map_from_odometry;
    if (const auto now = motion.newest()) {
      start_tracker_at(map_from_odometry * now->path_from_base * base_from_camera);
    }
  }

  void learn(const std::string& name) {
    if (!last_seen || !last_pose) {
      throw Error("the robot is not localised, so a view of this place has no position");
    }
    last_seen->pose = ReferencePose{last_pose->x_m, last_pose->y_m, last_pose->heading_rad};
    Memoriser memoriser(setup.memory, {.source = setup.tracker.source});
    last_seen->name = name;
    memoriser.add(*last_seen);
    memoriser.finish();
    reload(setup.memory, last_pose);
  }

  void forget(const std::string& name) {
    MemoryFile writable = MemoryFile::open(setup.memory, Access::read_write);
    const ViewId view = named_view(writable, name);
    writable.remove({&view, 1});
    reload(setup.memory, last_pose);
  }

  /// Whoever may write to a topic may not open any file that the node may read.
  void load(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code code;
    const fs::path folder = fs::weakly_canonical(fs::absolute(setup.memory), code).parent_path();
    const fs::path wanted = fs::weakly_canonical(folder / path, code);
    if (code || wanted.parent_path() != folder) {
      throw ContractError("file to load", "'" + readable_line(shortened(path, 80)) + "'",
                          "the name of a file in the folder of the memory");
    }
    reload(wanted, std::nullopt);
    const std::lock_guard lock(mutex);
    map_from_path.reset();  // of the other memory's frame
  }

  /// The memory that counts until now stays if this throws.
  void localise_by(const std::filesystem::path& path) {
    MemoryFile opened = MemoryFile::open(path, Access::read_only);
    Tracker made(opened, setup.tracker);
    end_way("another memory");
    navigator.reset();
    driver.reset();
    file.emplace(std::move(opened));
    tracker.emplace(std::move(made));
    setup.memory = path;
    last_seen.reset();
    last_pose.reset();
    publish_references();
  }

  void reload(const std::filesystem::path& path, const std::optional<Pose2> here) {
    localise_by(path);
    if (here) start_tracker_at(*here);
  }

  void start_tracker_at(const Pose2& camera) {
    tracker->start_at(camera, 0.5 * tracker->localiser().model().spacing_m, 0.1);
  }

  /// Those that ways are planned over, a number each.
  void publish_areas() {
    PointValues cloud;
    const auto& planner = navigator->planner();
    for (std::size_t node = 0; node < planner.graph().size(); ++node) {
      const auto& pose = tracker->memory().info(planner.graph().view(node)).pose;
      if (pose) cloud.add(pose->position(), static_cast<double>(planner.areas().area_of[node]));
    }
    areas.publish(cloud.message(now_ns(), setup.frames.map, "area"));
  }

  void publish_references() {
    PointValues cloud;
    for (const ViewId view : tracker->memory().views()) {
      const auto& pose = tracker->memory().info(view).pose;
      if (pose) cloud.add(pose->position(), static_cast<double>(cloud.values.size() / 4));
    }
    references.publish(cloud.message(now_ns(), setup.frames.map, "number"));
  }

  LocalisationNodeSetup setup;
  LocalisationNodeOptions options;
  RareNotes notes;
  Pose2 base_from_camera{options.camera_x_m, options.camera_y_m, 0.0};
  // Of the thread that looks: either a teacher, or a memory that it localises by.
  std::optional<Teacher> teacher;
  std::optional<MemoryFile> file;
  std::optional<Tracker> tracker;
  std::size_t taught = 0;  // pictures
  Participant participant;
  Publisher<ros::TFMessage> transforms;
  Publisher<ros::PoseWithCovarianceStamped> poses;
  Publisher<ros::PoseArray> particles;
  Publisher<ros::PointCloud2> references, areas;
  Publisher<ros::CompressedImage> best_matches;
  Publisher<ros::DiagnosticArray> diagnostics;
  Publisher<ros::Twist> velocities;
  Publisher<ros::DiagnosticArray> feedback, results;
  Publisher<ros::String> answers;
  std::optional<RobotNavigator> navigator;  // of the thread that looks, as the next
  std::optional<RouteDriver> driver;        // instead of the navigator, along a route
  Mission mission;
  std::optional<Mission> resumed;  // until the first picture
  Steady::time_point mission_kept;
  std::optional<Observation> last_seen;
  std::optional<Pose2> last_pose;  // where it was seen; empty: not localised then
  std::atomic<bool> stopped = false;
  std::atomic<std::int64_t> sim_ns = 0;
  FrameTree frames;  // of the thread of `run`, as the next two
  std::optional<ros::Pose> last_transform;
  std::int64_t last_transform_ns = 0;

  mutable std::mutex mutex;  // of what follows
  std::condition_variable changed;
  MotionHistory motion;
  std::optional<Pose2> map_from_path;
  std::optional<Tilt> tilt;
  std::optional<std::int64_t> last_picture_ns;
  Steady::time_point last_picture_came = Steady::now();
  std::optional<Bytes> picture;  // the newest
  std::deque<Job> jobs;
  Counts counts;

  mutable std::mutex command_mutex;  // of these, and of the order of velocities
  bool driving = false;
  Steady::time_point last_command;
};

LocalisationNode::LocalisationNode(const LocalisationNodeSetup& setup, RareNotes::Note note)
    : implementation_(std::make_unique<Implementation>(setup, std::move(note))) {}
LocalisationNode::~LocalisationNode() = default;

void LocalisationNode::run() {
  implementation_->run();
}

void LocalisationNode::stop() {
  implementation_->stopped = true;
  implementation_->participant.wake();
}

LocalisationNode::Counts LocalisationNode::counts() const {
  Counts counts;
  {
    const std::lock_guard lock(implementation_->mutex);
    counts = implementation_->counts;
  }
  counts.notes = implementation_->notes.count();
  return counts;
}

}  // namespace panonav::ros2
