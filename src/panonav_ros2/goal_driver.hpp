#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/robot_explorer.hpp"
#include "panonav/pipeline/route_driver.hpp"
#include "panonav_ros2/mission.hpp"
#include "panonav_ros2/node_setup.hpp"
#include "panonav_ros2/robot_motion.hpp"

namespace panonav::ros2 {

/// The memory of a localisation node, opened for tracking.
struct LoadedMemory {
  std::filesystem::path path;
  MemoryFile file;
  Tracker tracker;
};

/// Drives a robot to a goal, along a route or through an unknown place by velocities on `cmd_vel`,
/// and reports on `~/goal/feedback` and `~/goal/result`. To be called by the localising thread,
/// unless stated otherwise.
class GoalDriver {
 public:
  GoalDriver(Participant& participant, const LocalisationNodeSetup& setup, WarningLog& log,
             const RobotMotion& motion, NowNs now_ns);

  /// Ends the mission and uses `memory` for the next ones; it must outlive this object or the next
  /// call.
  void set_memory(const LoadedMemory& memory);
  /// Returns the unfinished mission of a node that used the same memory and died; nullopt if there
  /// is none.
  [[nodiscard]] std::optional<Mission> load_interrupted_mission();

  /// Starts a mission and ends the previous one. Reports it and throws Error if there is no path.
  void start(const Mission& mission);
  /// Reports that the robot touches an obstacle at a point in the base frame. If it was driving
  /// towards that point, the next `drive` plans another path to a goal, or ends a route.
  void report_contact(Point2 contact);
  /// Sends the velocity for this image if there is a mission. `pose` is the camera's pose in the
  /// map, `nullopt` if the robot is not localised.
  void drive(const Observation& observation, const std::optional<Pose2>& pose);

  /// Starts the exploration that makes the memory of the node. `has_ranges`: `explore` gets ranges.
  /// Reports it and throws Error if there was one before or the file exists.
  void start_exploration(bool has_ranges);
  /// Sends the velocity for this image if there is an exploration. At its end its memory is stored.
  void explore(const Observation& observation, const SensedObstacles& sensed);
  /// Returns the present or last exploration; null if there is none, or a memory was set since.
  [[nodiscard]] const RobotExplorer* explorer() const noexcept {
    return explorer_ ? &*explorer_ : nullptr;
  }
  /// True between `start` and `end`. May be called from any thread.
  [[nodiscard]] bool has_mission() const;

  /// Stops the robot, stores the memory of an exploration and reports why, if there is a mission.
  /// May be called from any thread, but not
  /// while another thread is in a function above.
  void end(const std::string& why, std::uint8_t level = warning);
  /// Stops the robot if no velocity was sent for `command_timeout_s`, for whatever reason. May be
  /// called from any thread.
  void stop_if_silent();

 private:
  static constexpr std::uint8_t fine = 0;  // levels of diagnostic_msgs/DiagnosticStatus
  static constexpr std::uint8_t warning = 1;
  static constexpr std::uint8_t error = 2;

  void begin();
  void make_route_driver(const Mission& mission);
  void set_goal(Point2 goal);
  void drive_to_goal(const Observation& observation, const std::optional<Pose2>& pose);
  void drive_along_route(const Observation& observation, const std::optional<Pose2>& pose);
  void drive_along_chain(const Observation& observation);
  void send(const Velocity& velocity);
  void publish_areas();
  [[nodiscard]] std::vector<recordings::ros::KeyValue> describe_exploration() const;
  [[nodiscard]] recordings::ros::DiagnosticArray make_message(
      std::uint8_t level, const std::string& state,
      std::vector<recordings::ros::KeyValue> values) const;

  const LocalisationNodeSetup& setup_;
  WarningLog& log_;
  const RobotMotion& motion_;
  NowNs now_ns_;
  Publisher<recordings::ros::Twist> velocities_;
  Publisher<recordings::ros::DiagnosticArray> feedback_, results_;
  Publisher<recordings::ros::PointCloud2> areas_;
  const LoadedMemory* memory_ = nullptr;
  std::optional<MissionFile> mission_file_;
  Mission mission_;
  std::optional<RobotNavigator> navigator_;
  // Used instead of the navigator: along a route panorama, along a chain of snapshots.
  std::optional<RouteDriver> route_driver_;
  std::optional<ChainDriver> chain_driver_;
  std::optional<RobotExplorer> explorer_;
  Velocity velocity_ = {};      // the last one sent
  bool is_obstructed_ = false;  // by an obstacle in its direction

  mutable std::mutex mutex_;  // guards the following members and the order of velocities
  bool has_mission_ = false;
  std::chrono::steady_clock::time_point last_command_;
};

}  // namespace panonav::ros2
