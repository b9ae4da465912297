#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "panonav/core/options.hpp"
#include "panonav/pipeline/robot_navigator.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav_ros2/participant.hpp"
#include "panonav_ros2/teacher.hpp"

namespace panonav::ros2 {

/// Where the motion of the robot is read.
enum class MotionInput { odometry, tf };
/// How pictures come: "image" as sensor_msgs/Image, or "image/compressed" as CompressedImage.
enum class PictureInput { raw, compressed };

struct LocalisationNodeOptions {
  MotionInput motion = MotionInput::odometry;
  PictureInput pictures = PictureInput::raw;
  double transform_tolerance_s = 1.0;
  double transform_rate_hz = 50.0;
  bool use_sim_time = false;
  bool tilt_from_imu = false;
  double command_timeout_s = 0.5;
  double resume_s = 30.0;
  double camera_x_m = 0.0;
  double camera_y_m = 0.0;
};
void visit_options(LocalisationNodeOptions& options, OptionVisitor& visitor);

/// As REP 105 names them.
struct FrameNames {
  std::string map = "map";
  std::string odom = "odom";
  std::string base = "base_link";
};

struct LocalisationNodeSetup {
  std::filesystem::path memory;
  ParticipantOptions participant;
  FrameNames frames;
  LocalisationNodeOptions node;
  TrackerOptions tracker;
  RobotNavigatorOptions navigator;  ///< of ways to a goal; its base of routes, too
  /// The memory is a new one that the first drive makes, until the command "finish".
  std::optional<TeacherOptions> teacher;
};

/// Says lines, at most one of a kind in ten seconds, with how often it would have been said.
class RareNotes {
 public:
  using Note = std::function<void(const std::string& line)>;
  explicit RareNotes(Note note);
  ~RareNotes();
  /// From any thread. `kind`: one of few.
  void say(std::string_view kind, const std::string& line);
  /// All that were to be said.
  [[nodiscard]] std::size_t count() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Localises a robot for ROS 2 by its pictures and odometry and a memory (`Tracker`), as AMCL does
/// by laser scans: the transform from map to odom, which a picture corrects and odometry carries on
/// meanwhile, pose, particles, references, best match and diagnostics. Sent to a goal, it drives
/// the robot to the remembered view next to it (`RobotNavigator`), or along a route
/// (`RouteDriver`); what it was sent to stands in a file beside the memory, so that a node that is
/// started anew after it died goes on. Without a memory it learns one (`Teacher`). docs/ros2.md has
/// the topics. One thread takes and sends messages, another one looks at pictures, always the
/// newest.
class LocalisationNode {
 public:
  /// `note` hears warnings, a line each, from any thread. Throws as `Tracker` and `Participant`.
  LocalisationNode(const LocalisationNodeSetup& setup, RareNotes::Note note);
  ~LocalisationNode();
  LocalisationNode(const LocalisationNode&) = delete;
  LocalisationNode& operator=(const LocalisationNode&) = delete;

  /// Until `stop` is called.
  void run();
  /// From any thread.
  void stop();

  struct Counts {
    std::size_t pictures = 0;   ///< looked at
    std::size_t localised = 0;  ///< of these
    std::size_t dropped = 0;    ///< came while another one was looked at
    std::size_t notes = 0;
    std::size_t learnt = 0;  ///< views of a first drive
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::ros2
