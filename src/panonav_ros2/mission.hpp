#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "panonav/geometry/pose2.hpp"
#include "panonav_ros2/warning_log.hpp"

namespace panonav::ros2 {

/// Destination of a robot: a goal pose in the map, or a route.
struct Mission {
  std::optional<Pose2> goal;
  std::string route;
  bool back = false;  ///< along a chain of snapshots from its end; such a drive is not stored
  std::optional<double> along_m = {};  ///< path length already driven
  double min_correlation = 0.0;  ///< threshold learnt by the route's follower; 0: not yet learnt
  Pose2 map_from_odom = {};      ///< when the mission was stored
};

/// Stores the mission of a running node in a file next to its memory, so that a restarted node
/// continues it. The file contains the boot id of the system and the time since boot, which cannot
/// be set and includes suspended time.
class MissionFile {
 public:
  /// `max_age_s` is the largest age of a mission that is continued; 0: nothing is stored.
  MissionFile(const std::filesystem::path& memory, double max_age_s);

  /// Writes the mission at most once per second. The file's modification time thus shows when the
  /// node died.
  void store_if_due(const Mission& mission, const std::optional<Pose2>& map_from_odom);
  void remove();
  /// Reads the mission of another node; `nullopt` if there is no file. A file that is too old, has
  /// a time in the future, is from before the last boot, or is damaged is removed with a warning.
  [[nodiscard]] std::optional<Mission> load(WarningLog& log);

 private:
  std::filesystem::path path_;
  double max_age_s_;
  std::chrono::steady_clock::time_point stored_;
};

}  // namespace panonav::ros2
