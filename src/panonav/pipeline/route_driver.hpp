#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panonav/motion/path_follower.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/pipeline/chain_route.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/route/chain_helm.hpp"

namespace panonav {

/// Options for repeating a route.
struct RouteDriverOptions {
  RouteFollowerOptions follower;  ///< how the robot is located on the route
  PathFollowerOptions path;       ///< how closely the robot keeps to the path
  BaseOptions base;               ///< drive of the robot, and limits of its velocities
  /// Distance along the route at which an earlier drive ended. If the route passes the robot's
  /// position several times, the drive starts at the passage nearest to this distance; nullopt: at
  /// the first passage.
  std::optional<double> resume_m;
};

/// Repeats a recorded route [Y03]: takes an image with its odometry, returns a velocity. The robot
/// drives from its position on the route to the end, by pure pursuit of the positions of the
/// route's lines (`PathFollower`). One thread at a time.
class RouteDriver {
 public:
  /// State of a repeated route.
  enum class State {
    searching,  ///< the robot stands still, as its position is not yet known
    driving,    ///< the robot is on its way to the end of the route
    arrived,    ///< at the end of the route
    lost,       ///< not found on the route, or without a fix for so long that odometry alone is
                ///< unreliable
  };

  /// The robot's next motion after an observation, and its position relative to the route.
  struct Step {
    State state = State::searching;  ///< after this observation
    Velocity velocity;               ///< for the next period of the base; 0 unless driving
    std::optional<RouteFix> fix;     ///< nullopt: the robot drives by odometry
    double along_m = 0.0;            ///< distance along the route
    double length_m = 0.0;           ///< length of the route
  };

  /// Longest distance that the robot drives by odometry without a fix.
  static constexpr double max_blind_m = 1.0;
  /// Number of pictures without a fix after which a searching robot is lost.
  static constexpr int max_searches = 10;

  /// Throws as `RouteFollower`, and OptionError.
  RouteDriver(const MemoryFile& memory, const std::optional<PictureSource>& source,
              const RouteDriverOptions& options = {});

  /// Returns the next motion; call it once in each period of the base until the robot has arrived
  /// or is lost. `other_estimate`: pose of the robot in the route's frame by another method
  /// (`Tracker`). While it agrees with the pose by odometry since the last fix, the robot may drive
  /// without a fix. Throws as `LineEncoder::line`, ContractError on an observation without
  /// odometry.
  [[nodiscard]] Step step(const Observation& observation,
                          const std::optional<Pose2>& other_estimate = std::nullopt);

  /// Returns the follower, which locates the robot relative to the route.
  [[nodiscard]] const RouteFollower& follower() const noexcept { return follower_; }

 private:
  [[nodiscard]] std::span<const Pose2> poses() const { return follower_.tracker().lines().poses(); }
  void plan_path_from(Point2 place);

  RouteDriverOptions options_;
  RouteFollower follower_;
  std::optional<PathFollower> path_;  // from the robot's first position to the end
  double start_m_ = 0.0;              // along the route
  double length_m_ = 0.0;
  std::optional<Pose2> odometry_;  // of the last step
  double blind_m_ = 0.0;           // driven since the last fix
  int failed_searches_ = 0;
};

/// Returns "searching", "driving", "arrived" or "lost".
[[nodiscard]] std::string_view to_string(RouteDriver::State state);

/// Repeats a chain of snapshots: takes an image with its odometry, returns a velocity. The robot
/// carries out one motion of a `ChainGuide` by odometry, then decides the next one by the image at
/// its end; images in between are not used. One thread at a time.
class ChainDriver {
 public:
  /// The robot's next motion after an observation, and its place along the chain.
  struct Step {
    ChainState state = ChainState::travelling;  ///< after the last decision
    Velocity velocity;                          ///< for the next period; 0 if arrived or lost
    bool decided = false;                       ///< true if this image decided the next motion
    std::size_t snapshot = 0;  ///< number of the snapshot ahead, from 1 in the recorded order
    double remaining_m = 0.0;  ///< length of the present motion that is left
  };

  /// Throws as `ChainGuide`, and OptionError.
  ChainDriver(const MemoryFile& memory, const std::optional<PictureSource>& source,
              const std::optional<std::string>& name, ChainDirection direction,
              const BaseOptions& base = {});

  /// Returns the next motion; call it once in each period of the base until the robot has arrived
  /// or is lost. Throws as `ChainGuide::step`.
  [[nodiscard]] Step step(const Observation& observation);

  /// Returns the chain.
  [[nodiscard]] const SnapshotChain& chain() const noexcept { return guide_.chain(); }

 private:
  ChainGuide guide_;
  ChainHelm helm_;
};

}  // namespace panonav
