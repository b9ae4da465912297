#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "panonav/geometry/pose2.hpp"
#include "panonav_ros2/warning_log.hpp"

namespace panonav::ros2 {

/// Destination of a robot: a place of the map, or a route.
struct Mission {
  std::optional<Pose2> goal;
  std::string route;
  std::optional<double> along_m = {};  ///< distance along the route
  double min_correlation =
      0.0;                   ///< lowest correlation, learnt by the route's follower; 0: learn it
  Pose2 map_from_odom = {};  ///< when the mission was stored
};

/// Stores the mission of a running node in a file next to its memory, so that a restarted node
/// continues it. The file says in which run of the system it was written, and when by a clock that
/// nobody sets and that runs while the system sleeps.
class MissionFile {
 public:
  /// `max_age_s`: older missions are not continued; 0: nothing is stored.
  MissionFile(const std::filesystem::path& memory, double max_age_s);

  /// Writes the mission if the last time is a second ago: the file's time of change shows when the
  /// node died.
  void store_if_due(const Mission& mission, const std::optional<Pose2>& map_from_odom);
  void remove();
  /// Reads the mission of another node. `nullopt` if there is no file; one that is too old, comes
  /// from the future or from before the system was started, or is damaged is removed with a
  /// warning.
  [[nodiscard]] std::optional<Mission> load(WarningLog& log);

 private:
  std::filesystem::path path_;
  double max_age_s_;
  std::chrono::steady_clock::time_point stored_;
};

}  // namespace panonav::ros2
