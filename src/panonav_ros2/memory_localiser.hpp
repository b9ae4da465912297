#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "panonav_recordings/run_messages.hpp"
#include "panonav_ros2/goal_driver.hpp"
#include "panonav_ros2/node_setup.hpp"
#include "panonav_ros2/participant.hpp"
#include "panonav_ros2/robot_motion.hpp"

namespace panonav::ros2 {

/// Localises a robot by a memory, corrects its motion, calls the driver with each image, and
/// publishes pose, particles, references and best match. Until the first `load`, functions throw
/// Error.
class MemoryLocaliser {
 public:
  MemoryLocaliser(Participant& participant, const LocalisationNodeSetup& setup, RobotMotion& motion,
                  GoalDriver& driver, NowNs now_ns);

  /// Loads a memory. If this throws, the previous memory remains loaded.
  void load(std::filesystem::path path);
  /// Loads another memory by its file name, only from the same folder, so that a message cannot
  /// open every file that the node may read.
  void load_neighbour(const std::string& name);
  /// Reads the mission of a node that died; the next image continues it.
  void load_interrupted_mission();
  /// Adds the last image to the memory as a view at its estimated pose.
  void add_view(const std::string& name);
  void remove_view(const std::string& name);

  void start_globally();
  void start_at(const Pose2& map_from_base, double deviation_m, double heading_deviation_rad);
  /// Starts at a pose whose uncertainty is that of localised poses in the map.
  void start_at(const Pose2& map_from_base);

  /// Localises by an image; its odometry is the camera's pose after `moved`. Returns the state of
  /// the run.
  [[nodiscard]] recordings::RunMoment localise(Observation observation, std::int64_t stamp_ns,
                                               const RobotMotion::Motion& moved);

 private:
  [[nodiscard]] LoadedMemory& loaded() const;
  void reload();
  void refresh_if_due();
  void start_tracker_at(const Pose2& map_from_camera);
  void resume(const Mission& mission, const RobotMotion::Motion& now);
  void correct_motion(const Pose2& map_from_base, const Pose2& path_from_base,
                      recordings::RunMoment& moment);
  void publish_estimate(recordings::RunMoment& moment, std::int64_t stamp_ns) const;
  void publish_best_match(ViewId view, std::int64_t stamp_ns) const;
  void publish_references();

  const LocalisationNodeSetup& setup_;
  RobotMotion& motion_;
  GoalDriver& driver_;
  NowNs now_ns_;
  Publisher<recordings::ros::PoseWithCovarianceStamped> poses_;
  Publisher<recordings::ros::PoseArray> particles_;
  Publisher<recordings::ros::PointCloud2> references_;
  std::string published_floor_;  // of `references_`
  Publisher<recordings::ros::CompressedImage> best_matches_;
  Pose2 base_from_camera_;
  std::unique_ptr<LoadedMemory> memory_;
  std::optional<Mission> interrupted_mission_;  // continued at the first image
  std::optional<Observation> last_observation_;
  std::chrono::steady_clock::time_point last_refresh_ = std::chrono::steady_clock::now();
  std::optional<Pose2> last_pose_;  // camera in the map; `nullopt`: not localised at last image
};

}  // namespace panonav::ros2
