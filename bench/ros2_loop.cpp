// A robot in the loop over DDS, in processes of their own: the simulated robot, the node, and this
// judge. It teaches a drive, repeats it, sends the robot to places of it, carries it elsewhere, and
// kills the node in the middle of its way. In a network of its own:
//   panonav simulate WORLD places --grid 0.5 --kind panorama
//   unshare -rn sh -c 'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo;
//     ros2_loop PANONAV WORLD places/poses.csv NEW.panonav 60 20 20 10 6 --rows 48 --columns 320'
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <queue>
#include <sstream>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/path_follower.hpp"
#include "panonav/motion/trajectory_error.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_ros2/participant.hpp"

namespace {

using namespace panonav;
using namespace panonav::ros2;

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Ends with whoever started it.
class Process {
 public:
  explicit Process(std::vector<std::string> words) : pid_(fork()) {
    if (pid_ != 0) return;
    std::vector<char*> raw;
    for (auto& word : words) raw.push_back(word.data());
    raw.push_back(nullptr);
    execvp(raw[0], raw.data());
    _exit(127);
  }
  ~Process() { end(SIGINT); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  void end(int signal) {
    if (pid_ <= 0) return;
    kill(pid_, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_;
};

std::vector<Point2> places_of(const std::string& csv) {
  std::vector<Point2> places;
  std::ifstream in(csv);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::vector<std::string> words;
    for (std::string field; std::getline(fields, field, ',');) words.push_back(field);
    if (words.size() > 3) places.push_back({std::stod(words[2]), std::stod(words[3])});
  }
  return places;
}

double step_of(const std::vector<Point2>& places) {
  double step_m = 1e9;
  for (std::size_t i = 1; i < places.size(); ++i) {
    step_m = std::min(step_m, distance(places[0], places[i]));
  }
  return step_m;
}

/// Those with room on all sides: nothing here looks for obstacles.
std::vector<Point2> roomy(const std::vector<Point2>& places) {
  const double step_m = step_of(places);
  std::vector<Point2> kept;
  std::ranges::copy_if(places, std::back_inserter(kept), [&](Point2 place) {
    return std::ranges::count_if(
               places, [&](Point2 other) { return distance(place, other) < 1.5 * step_m; }) == 9;
  });
  return kept;
}

/// Shortest way over neighbours of the grid.
std::vector<Point2> way_between(const std::vector<Point2>& places, std::size_t from, std::size_t to,
                                double step_m) {
  std::vector<double> way(places.size(), 1e9);
  std::vector<std::size_t> before(places.size(), from);
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  way[from] = 0.0;
  open.emplace(0.0, from);
  while (!open.empty()) {
    const auto [so_far, at] = open.top();
    open.pop();
    if (so_far > way[at]) continue;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double step = distance(places[at], places[i]);
      if (step > 1.01 * step_m || so_far + step >= way[i]) continue;
      way[i] = so_far + step;
      before[i] = at;
      open.emplace(way[i], i);
    }
  }
  std::vector<Point2> found;
  if (way[to] >= 1e9) return found;
  for (std::size_t at = to;; at = before[at]) {
    found.push_back(places[at]);
    if (at == from) break;
  }
  std::ranges::reverse(found);
  return found;
}

/// A drive of the wanted length from place to place, at random.
std::vector<Point2> drive_of(const std::vector<Point2>& places, double length_m, Random& random) {
  const double step_m = step_of(places);
  std::vector<Point2> path;
  std::size_t at = random.index(places.size());
  double driven_m = 0.0;
  while (driven_m < length_m) {
    const std::size_t to = random.index(places.size());
    const auto leg = way_between(places, at, to, step_m);
    if (leg.size() < 4) {
      if (path.empty()) at = random.index(places.size());
      continue;
    }
    for (const Point2 place : leg) {
      if (!path.empty() && distance(path.back(), place) < 1e-6) continue;
      if (!path.empty()) driven_m += distance(path.back(), place);
      path.push_back(place);
      if (driven_m >= length_m) break;
    }
    at = to;
  }
  return path;
}

recordings::ros::PoseStamped in_map(const Pose2& pose) {
  recordings::ros::PoseStamped message;
  message.header.frame_id = "map";
  message.pose = recordings::ros::to_pose(pose);
  return message;
}

struct Judge {
  explicit Judge()
      : participant({.node = "judge"}, [](const std::string& line) { puts(line.c_str()); }) {
    hear<recordings::ros::PoseStamped>(
        "ground_truth", [this](const recordings::ros::PoseStamped& message) {
          truth = recordings::ros::to_pose2(message.pose);
          now_s = 1e-9 * static_cast<double>(message.header.stamp_ns);
          seen = true;
        });
    hear<recordings::ros::TFMessage>("/tf", [this](const recordings::ros::TFMessage& message) {
      for (const auto& each : message.transforms) {
        if (each.child_frame_id == "base_link")
          odom_from_base = recordings::ros::to_pose2(each.transform);
        if (each.child_frame_id != "odom") continue;
        map_from_odom = recordings::ros::to_pose2(each.transform);
        if (last_transform_s > 0.0) gaps_ms.push_back(1e3 * (wall_s() - last_transform_s));
        last_transform_s = wall_s();
      }
    });
    hear<recordings::ros::DiagnosticArray>(
        "/diagnostics", [this](const recordings::ros::DiagnosticArray& message) {
          state = message.status.at(0).message;
          values.clear();
          for (const auto& [key, value] : message.status.at(0).values) {
            values += "  " + std::string(key) + " " + std::string(value);
          }
          ++pictures;
        });
    hear<recordings::ros::DiagnosticArray>(
        "panonav/goal/result", [this](const recordings::ros::DiagnosticArray& message) {
          const std::string status = message.status.at(0).message;
          if (status != "another goal") result = status;
        });
    hear<recordings::ros::DiagnosticArray>(
        "panonav/goal/feedback", [this](const recordings::ros::DiagnosticArray& message) {
          ++feedback;
          way.clear();
          for (const auto& [key, value] : message.status.at(0).values) {
            way += " " + std::string(key) + " " + std::string(value);
          }
        });
    hear<recordings::ros::String>(
        "panonav/command/result",
        [this](const recordings::ros::String& message) { answer = message.data; });
    hear<recordings::ros::Twist>("cmd_vel", [this](const recordings::ros::Twist& message) {
      if (message.linear.x != 0.0 || message.angular.z != 0.0) last_command_s = wall_s();
    });
  }
  template <class Message, class Use>
  void hear(const std::string& topic, Use use) {
    participant.subscribe(topic, Message::type, {.depth = 50}, [use](auto cdr) {
      use(recordings::ros::read_message<Message>(cdr, recordings::MessageEncoding::cdr));
    });
  }
  bool until(double sim_s, const std::function<bool()>& condition) {
    double end_s = -1.0;
    while (true) {
      participant.wait(std::chrono::milliseconds(5));
      if (!seen) continue;
      if (end_s < 0.0) end_s = now_s + sim_s;
      if (condition()) return true;
      if (now_s > end_s) return false;
    }
  }
  void carry(const Pose2& to) {
    set_pose.publish(in_map(to));
    until(1.0, [] { return false; });
  }
  [[nodiscard]] Pose2 estimate() const { return map_from_odom * odom_from_base; }

  Participant participant;
  Publisher<recordings::ros::PoseStamped> set_pose{participant, "set_pose"},
      goal{participant, "goal_pose"};
  Publisher<recordings::ros::Twist> cmd_vel{participant, "cmd_vel"};
  Publisher<recordings::ros::String> command{participant, "panonav/command"};
  Pose2 truth, odom_from_base, map_from_odom;
  double now_s = 0.0, last_transform_s = 0.0, last_command_s = 0.0;
  bool seen = false;
  std::string state, result, answer, values, way;
  std::size_t pictures = 0, feedback = 0;
  std::vector<double> gaps_ms;
};

/// A place of the drive: where the robot was, and where the memory has it.
struct Taught {
  Pose2 truth, map;
};

/// Drives along the path. Tells where the robot was, and where its odometry had it.
std::vector<StampedPose> teach(Judge& judge, const std::vector<Point2>& path,
                               std::vector<StampedPose>& by_odometry) {
  PathFollower follower(path);
  const BaseOptions base;
  std::vector<StampedPose> truths;
  double next_s = 0.0;
  judge.until(3600, [&] {
    if (truths.empty() || judge.now_s > truths.back().stamp_s) {
      truths.push_back({judge.now_s, judge.truth});
    }
    if (judge.now_s < next_s) return false;
    next_s = judge.now_s + 0.05;
    if (by_odometry.empty() || judge.now_s > by_odometry.back().stamp_s) {
      by_odometry.push_back({judge.now_s, judge.estimate()});
    }
    const auto aim = follower.next_target(judge.truth.position());
    Velocity velocity;
    if (aim) {
      const Point2 ahead = inverse(judge.truth) * *aim;
      velocity = compute_command_towards(std::atan2(ahead.y_m, ahead.x_m),
                                         std::hypot(ahead.x_m, ahead.y_m), base);
    }
    judge.cmd_vel.publish({{velocity.forward_m_s, 0.0, 0.0}, {0.0, 0.0, velocity.turn_rad_s}});
    return !aim;
  });
  return truths;
}

/// The views of the memory with the stamps of their pictures.
std::vector<StampedPose> taught_views(const std::string& memory) {
  std::vector<StampedPose> taught;
  const auto views = MemoryFile::open(memory, Access::read_only).load();
  for (const ViewId view : views.views()) {
    const auto& info = views.info(view);
    if (!info.pose || !info.stamp_s) continue;
    taught.push_back(
        {*info.stamp_s, {info.pose->x_m, info.pose->y_m, info.pose->heading_rad.value_or(0.0)}});
  }
  return taught;
}

/// After the best common motion of all.
double rms_m(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truths) {
  const Trajectory truth(truths);
  Trajectory estimated;
  Trajectory interpolated;
  for (const StampedPose& each : estimate) {
    const auto pose = truth.at(each.stamp_s, 1.0);
    if (!pose) continue;
    estimated.append(each);
    interpolated.append({each.stamp_s, *pose});
  }
  const auto error = trajectory_error(estimated, interpolated);
  return error ? error->position_m.rms : -1.0;
}

double distance_to_nearest(const std::vector<StampedPose>& truths, Point2 place) {
  double nearest = 1e9;
  for (const auto& each : truths) {
    nearest = std::min(nearest, distance(each.pose.position(), place));
  }
  return nearest;
}

// A node that learns a drive, the judge of it, and what they do one after the other.
class Loop {
 public:
  Loop(std::vector<std::string> simulate, std::vector<std::string> node_words)
      : node_words_(std::move(node_words)), robot_(std::move(simulate)) {}

  // The robot is driven along the path while the node learns; the node makes its map of that.
  void teach_drive(const std::vector<Point2>& path) {
    auto learning = node_words_;
    learning.insert(learning.end(), {"--teach", "--route", "drive", "--kind", "panorama",
                                     "--elevation-deg", "-30", "40"});
    // The robot first stands where the drive begins.
    wait(2.0);
    const Point2 ahead = path[1];
    judge_.carry(
        {path[0].x_m, path[0].y_m, std::atan2(ahead.y_m - path[0].y_m, ahead.x_m - path[0].x_m)});
    Process node(learning);
    judge_.until(60.0, [&] { return judge_.pictures > 2; });
    std::vector<StampedPose> by_odometry;
    truths_ = teach(judge_, path, by_odometry);
    wait(1.0);
    printf("taught:%s; its odometry is off by %.2f m rms\n", judge_.values.c_str(),
           rms_m(by_odometry, truths_));
    const double before_s = wall_s();
    judge_.command.publish({"finish"});
    judge_.until(600.0, [&] { return !judge_.answer.empty(); });
    printf("%s after %.1f s\n", judge_.answer.c_str(), wall_s() - before_s);
  }

  // Starts the node that drives, on what was learnt; false where nothing was.
  bool start_node(const std::string& memory) {
    const auto views = taught_views(memory);
    printf("the map is off by %.2f m rms\n", rms_m(views, truths_));
    for (const auto& [stamp_s, pose] : views) {
      const auto at = std::ranges::lower_bound(truths_, stamp_s, {}, &StampedPose::stamp_s);
      if (at != truths_.end()) taught_.push_back({at->pose, pose});
    }
    if (taught_.empty()) return false;
    node_ = std::make_unique<Process>(node_words_);
    judge_.last_transform_s = 0.0;
    judge_.gaps_ms.clear();
    judge_.pictures = 0;
    judge_.until(60.0, [&] { return judge_.pictures > 2; });
    wait(2.0);
    return true;
  }

  // True if the node relocalises after the robot was kidnapped.
  bool kidnap(int number, Random& random) {
    const Taught& place = taught_[random.index(taught_.size())];
    judge_.carry(place.truth * Pose2{0.0, 0.0, random.uniform(-3.0, 3.0)});
    wait(1.0);
    const double start_s = judge_.now_s;
    const auto off_m = [&] { return distance(judge_.estimate().position(), place.map.position()); };
    const bool right =
        judge_.until(40.0, [&] { return judge_.state == "localised" && off_m() < 0.5; });
    printf("kidnapped %d: %s after %.1f s, %.2f m off, %s\n", number, right ? "found" : "not found",
           judge_.now_s - start_s, off_m(), judge_.state.c_str());
    return right;
  }

  bool repeat(bool is_killed, double limit_s, Random& random) {
    judge_.carry(truths_.front().pose * Pose2{0.0, random.uniform(-0.1, 0.1), 0.0});
    return drive(
        "repeated", [&] { judge_.command.publish({"repeat drive"}); },
        truths_.back().pose.position(), is_killed, limit_s);
  }

  bool go_to_goal(bool is_killed, Random& random) {
    const Taught& place = taught_[random.index(taught_.size())];
    return drive(
        "mission", [&] { judge_.goal.publish(in_map(place.map)); }, place.truth.position(),
        is_killed, 600.0);
  }

  void report_gaps() const {
    if (judge_.gaps_ms.empty()) return;
    printf("map -> odom each %.1f ms, at 99.9 %% within %.1f ms, at most %.1f ms, %zu times\n",
           quantile(judge_.gaps_ms, 0.5), quantile(judge_.gaps_ms, 0.999),
           std::ranges::max(judge_.gaps_ms), judge_.gaps_ms.size());
  }

 private:
  void wait(double seconds) {
    judge_.until(seconds, [] { return false; });
  }

  // Kills the node and starts it again; returns after how many seconds the robot drives on.
  double kill_and_restart() {
    judge_.until(10.0, [&] { return !judge_.result.empty(); });
    node_->end(SIGKILL);
    judge_.last_transform_s = 0.0;
    wait(3.0);
    const double before_s = wall_s();
    node_ = std::make_unique<Process>(node_words_);
    judge_.until(100.0, [&] { return judge_.last_command_s > before_s; });
    return judge_.last_command_s - before_s;
  }

  bool drive(const char* what, const std::function<void()>& send, Point2 end, bool is_killed,
             double limit_s) {
    judge_.result.clear();
    judge_.feedback = 0;
    for (int i = 0; i < 5 && judge_.feedback == 0 && judge_.result.empty(); ++i) {
      send();
      judge_.until(30.0, [&] { return judge_.feedback > 0 || !judge_.result.empty(); });
    }
    const double resumed_s = is_killed ? kill_and_restart() : -1.0;
    const double start_s = judge_.now_s;
    double farthest_m = 0.0;
    judge_.until(limit_s, [&] {
      farthest_m = std::max(farthest_m, distance_to_nearest(truths_, judge_.truth.position()));
      return !judge_.result.empty();
    });
    const double off_m = distance(judge_.truth.position(), end);
    printf("%s: %s after %.0f s, %.2f m from its end, at most %.2f m beside the taught drive", what,
           judge_.result.c_str(), judge_.now_s - start_s, off_m, farthest_m);
    if (is_killed) printf("; killed, drove again %.2f s after its new start", resumed_s);
    puts(judge_.result == "arrived" ? "" : ("; at last" + judge_.way).c_str());
    return judge_.result == "arrived" && off_m < 0.5;
  }

  std::vector<std::string> node_words_;
  Process robot_;
  Judge judge_;
  std::vector<StampedPose> truths_;  // of the taught drive
  std::vector<Taught> taught_;
  std::unique_ptr<Process> node_;
};

}  // namespace

int main(int count, char** words) {
  if (count < 10) {
    puts("PANONAV WORLD PLACES.csv NEW.panonav METRES REPEATS MISSIONS KIDNAPPINGS FACTOR [WORDS]");
    return 2;
  }
  setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::string panonav = words[1], world = words[2], memory = words[4];
  const double metres = std::atof(words[5]);
  const int repeats = std::atoi(words[6]), missions = std::atoi(words[7]);
  const int kidnappings = std::atoi(words[8]);
  Random random(7);
  const auto path = drive_of(roomy(places_of(words[3])), metres, random);
  std::vector<std::string> simulate{panonav,  "simulate", world,           "--ros2",
                                    "--kind", "panorama", "--time-factor", words[9]};
  simulate.insert(simulate.end(), words + 10, words + count);
  Loop loop(std::move(simulate), {panonav, "ros2", memory, "--use-sim-time", "true"});
  loop.teach_drive(path);
  if (!loop.start_node(memory)) return 1;
  int found = 0;
  for (int i = 0; i < kidnappings; ++i) found += loop.kidnap(i, random) ? 1 : 0;
  int repeated = 0;
  for (int i = 0; i < repeats; ++i) {
    repeated += loop.repeat(i == 1, 2.0 * metres / 0.3 + 100.0, random) ? 1 : 0;
  }
  int reached = 0;
  for (int i = 0; i < missions; ++i) reached += loop.go_to_goal(i == 1, random) ? 1 : 0;
  printf("repeated %d of %d, reached %d of %d, found %d of %d\n", repeated, repeats, reached,
         missions, found, kidnappings);
  loop.report_gaps();
  return 0;
}
