#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/route/route_changes.hpp"
#include "panonav/route/route_tracker.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for following a route.
struct RouteFollowerOptions {
  std::optional<std::string> name;  ///< name of the route; nullopt: the only one
  RouteTrackerOptions tracker;      ///< search range, and thresholds for accepting a fit
  RouteFitOptions fit;              ///< how lines are fitted
  bool use_odometry = true;  ///< use odometry if available and the route is in metres; false: each
                             ///< observation is located separately
};

/// Locates a robot relative to a recorded route [Y03], observation by observation. Predicts its
/// position by odometry, if available. If the prediction fails, searches around it, then on the
/// whole route. One thread at a time, except `encode`.
class RouteFollower {
 public:
  /// The robot's position relative to the route.
  struct Step {
    std::vector<float> line;                          ///< pixels of the observation's line
    std::optional<RouteFix> fix;                      ///< nullopt: not found on the route
    std::vector<RouteChanges::AzimuthRange> changed;  ///< where the scene differs from the route's
  };

  /// Pictures come from the memory's own camera. Throws FileError, also if there is no such route,
  /// if there are several and `options.name` is not set, or if the route has fewer than two lines;
  /// OptionError.
  explicit RouteFollower(const std::filesystem::path& memory,
                         const RouteFollowerOptions& options = {});
  /// `source`: layout of the pictures; nullopt: that of the memory.
  RouteFollower(const MemoryFile& memory, const std::optional<PictureSource>& source,
                const RouteFollowerOptions& options = {});

  /// Encodes an observation for `step`; several threads may encode the next observations
  /// concurrently. Throws as `LineEncoder::line`, and as `ViewEncoder::require_fit`.
  [[nodiscard]] std::vector<float> encode(const Observation& observation) const {
    views_.require_fit(observation);
    return encoder_.line(observation);
  }
  /// Locates the robot by the next line (made by `encode`) and by the odometry of its observation,
  /// if any.
  [[nodiscard]] Step step(std::vector<float> line, const std::optional<Pose2>& odometry);
  /// Encodes the next observation and locates the robot. Throws as `encode`.
  [[nodiscard]] Step step(const Observation& observation) {
    return step(encode(observation), observation.odometry);
  }

  [[nodiscard]] const std::string& name() const noexcept {
    return name_;
  }  ///< Returns the name of the route in the memory.
  /// Returns how the route's lines were made, and where its poses came from.
  [[nodiscard]] const RouteSource& source() const noexcept { return source_; }
  /// Returns the tracker, with its present state.
  [[nodiscard]] const RouteTracker& tracker() const noexcept { return tracker_; }

 private:
  RouteFollowerOptions options_;
  std::string name_;
  RouteSource source_;
  ViewEncoder views_;
  LineEncoder encoder_;
  RouteTracker tracker_;
  RouteChanges changes_;
  std::optional<Pose2> odometry_;  // of the last step
};

}  // namespace panonav
