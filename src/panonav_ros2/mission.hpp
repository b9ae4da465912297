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
  std::optional<double> along_m = {};  ///< how far it is along the route
  double min_correlation = 0.0;        ///< that the route's follower learnt of it; 0: learn it
  Pose2 map_from_odom = {};            ///< when the mission was stored
};

/// Stores the mission of a running node in a file beside its memory, so that a node that is started
/// after one that died continues it.
class MissionFile {
 public:
  /// `max_age_s`: what was not stored for longer is not continued; 0: nothing is stored.
  MissionFile(const std::filesystem::path& memory, double max_age_s);

  /// Writes the mission if the last time is a second ago: the file's time of change shows when the
  /// node died.
  void store_if_due(const Mission& mission, const std::optional<Pose2>& map_from_odom);
  void remove();
  /// Reads what another node left. `nullopt` where there is no file; one that is too old or damaged
  /// is removed with a warning.
  [[nodiscard]] std::optional<Mission> load(WarningLog& log);

 private:
  std::filesystem::path path_;
  double max_age_s_;
  std::chrono::steady_clock::time_point stored_;
};

}  // namespace panonav::ros2
