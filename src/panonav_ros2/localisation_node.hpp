#pragma once

#include <cstddef>
#include <memory>

#include "panonav_ros2/node_setup.hpp"

namespace panonav::ros2 {

/// Localises a robot for ROS 2 by its pictures and odometry and a memory (`Tracker`), as AMCL does
/// by laser scans: the transform from map to odom, which a picture corrects and odometry continues
/// meanwhile, pose, particles, references, best match and diagnostics. Sent to a goal or along a
/// route, it drives the robot (`GoalDriver`); its mission is stored in a file next to the memory,
/// so that a restarted node continues it. Without a memory it makes one (`Teacher`). docs/ros2.md
/// has the topics. One thread receives and sends messages, another one localises by pictures,
/// always the newest.
class LocalisationNode {
 public:
  /// `note` receives warnings, a line each, from any thread. Throws as `Tracker` and `Participant`.
  LocalisationNode(const LocalisationNodeSetup& setup, Note note);
  ~LocalisationNode();
  LocalisationNode(const LocalisationNode&) = delete;
  LocalisationNode& operator=(const LocalisationNode&) = delete;

  /// Runs until `stop` is called.
  void run();
  /// May be called from any thread.
  void stop();

  struct Counts {
    std::size_t pictures = 0;   ///< pictures processed
    std::size_t localised = 0;  ///< of these
    std::size_t dropped = 0;    ///< pictures that arrived while another one was processed
    std::size_t notes = 0;
    std::size_t taught = 0;  ///< views of a first drive
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::ros2
