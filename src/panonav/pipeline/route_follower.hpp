#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/route/route_changes.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Which route is followed, and how the robot is found on it.
struct RouteFollowerOptions {
  std::optional<std::string> name;  ///< of the route; empty: the only one that there is
  RouteTrackerOptions tracker;      ///< where it is looked for, and when a fit is believed
  RouteFitOptions fit;              ///< how lines are fitted
  bool use_odometry = true;         ///< where observations have it; else each one alone
};

/// Says where a robot is beside a recorded route [Y03], observation by observation. Odometry
/// predicts where the last observation and this one have it; where the prediction does not hold the
/// robot is looked for around it, then on the whole route. One thread at a time, except `encode`.
class RouteFollower {
 public:
  /// The robot's position beside the route.
  struct Step {
    std::vector<float> line;                          ///< what was seen
    std::optional<RouteFix> fix;                      ///< empty: not on this route
    std::vector<RouteChanges::AzimuthRange> changed;  ///< where the scene is not as remembered
  };

  /// The memory's own camera takes the pictures. Throws FileError, also when there is no such
  /// route, several and none is named, or it has fewer than two lines; OptionError.
  explicit RouteFollower(const std::filesystem::path& memory,
                         const RouteFollowerOptions& options = {});
  /// Pictures lie as `source` says; empty: as the memory's own.
  RouteFollower(const MemoryFile& memory, const std::optional<PictureSource>& source,
                const RouteFollowerOptions& options = {});

  /// The part of `step` that several threads may do beside each other for observations to come.
  /// Throws as `LineEncoder::line`.
  [[nodiscard]] std::vector<float> encode(const Observation& observation) const {
    return encoder_.line(observation);
  }
  /// The next line, as `encode` gave it, with the odometry of its observation where it had one.
  [[nodiscard]] Step step(std::vector<float> line, const std::optional<Pose2>& odometry);
  /// The next observation. Throws as `encode`.
  [[nodiscard]] Step step(const Observation& observation) {
    return step(encode(observation), observation.odometry);
  }

  [[nodiscard]] const std::string& name() const noexcept {
    return name_;
  }  ///< Name of the route in the memory.
  /// How its lines were taken, and where its poses came from.
  [[nodiscard]] const RouteSource& source() const noexcept { return source_; }
  /// Returns what follows the robot, with its present state.
  [[nodiscard]] const RouteTracker& tracker() const noexcept { return tracker_; }

 private:
  RouteFollowerOptions options_;
  std::string name_;
  RouteSource source_;
  LineEncoder encoder_;
  RouteTracker tracker_;
  RouteChanges changes_;
  std::optional<Pose2> odometry_;  // of the step before
};

}  // namespace panonav
