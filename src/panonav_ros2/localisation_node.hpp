#pragma once

#include <cstddef>
#include <memory>

#include "panonav_ros2/node_setup.hpp"

namespace panonav::ros2 {

/// Localises a robot for ROS 2 by its images, odometry and a memory (`Tracker`), as AMCL does by
/// laser scans. Publishes the transform from map to odom (each image corrects it, odometry
/// continues it in between), pose, particles, references, best match and diagnostics. On request it
/// drives the robot to a goal or along a route (`GoalDriver`); the mission is stored in a file next
/// to the memory, so that a restarted node continues it. Without a memory it first makes one
/// (`Teacher`). docs/ros2.md lists the topics. One thread receives and sends messages; another one
/// localises, always by the newest image.
class LocalisationNode {
 public:
  /// `note` receives warnings, one line each, from any thread. Throws as `Tracker` and
  /// `Participant`.
  LocalisationNode(const LocalisationNodeSetup& setup, Note note);
  ~LocalisationNode();
  LocalisationNode(const LocalisationNode&) = delete;
  LocalisationNode& operator=(const LocalisationNode&) = delete;

  /// Runs until `stop` is called.
  void run();
  /// Makes `run` return. May be called from any thread.
  void stop();

  struct Counts {
    std::size_t pictures = 0;   ///< images processed
    std::size_t localised = 0;  ///< of these, images at which the robot was localised
    std::size_t dropped = 0;    ///< images replaced by newer ones before processing
    std::size_t notes = 0;
    std::size_t taught = 0;  ///< views recorded on a first drive
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::ros2
