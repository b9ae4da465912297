#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "panonav/motion/path_follower.hpp"
#include "panonav/motion/velocity.hpp"
#include "panonav/pipeline/route_follower.hpp"

namespace panonav {

/// Options for repeating a route.
struct RouteDriverOptions {
  RouteFollowerOptions follower;  ///< how the robot is found on it
  PathFollowerOptions path;       ///< how closely its path is kept
  BaseOptions base;               ///< what velocities are made for
  /// Distance along the route at which an earlier drive ended: where the route passes the robot's
  /// place several times, the drive continues at the pass nearest to it. Empty: at the first pass.
  std::optional<double> resume_m;
};

/// Repeats a recorded route [Y03]: a picture with its odometry in, a velocity out. It drives from
/// the place where the robot is, of several the first on the way, to the end of the route, by pure
/// pursuit of the positions of its lines (`PathFollower`). One thread at a time.
class RouteDriver {
 public:
  /// State of a repeated route.
  enum class State {
    searching,  ///< the robot stands: no line has told yet where it is
    driving,    ///< the robot is on its way to the end of the route
    arrived,    ///< at the end of the route
    lost,       ///< not found on the route, or not for so long that odometry alone is no guide
  };

  /// The robot's next motion after an observation, and its position beside the route.
  struct Step {
    State state = State::searching;  ///< after this observation
    Velocity velocity;               ///< for the next period of the base; 0 unless driving
    std::optional<RouteFix> fix;     ///< empty: odometry carries the robot on
    double along_m = 0.0;            ///< way along the route
    double length_m = 0.0;           ///< of the route
  };

  /// Without a fix it drives no farther by odometry that nobody confirms.
  static constexpr double max_blind_m = 1.0;
  /// Pictures after which a robot that stands is not on the route.
  static constexpr int max_searches = 10;

  /// Throws as `RouteFollower`, and OptionError.
  RouteDriver(const MemoryFile& memory, const std::optional<PictureSource>& source,
              const RouteDriverOptions& options = {});

  /// To be called once in each period of the base, until it arrived or is lost. `other_estimate`:
  /// pose of the robot in the frame of the route by another method (`Tracker`); as long as it
  /// agrees with the odometry since the last fix, the robot is not lost. Throws as
  /// `LineEncoder::line`, ContractError on an observation without odometry.
  [[nodiscard]] Step step(const Observation& observation,
                          const std::optional<Pose2>& other_estimate = std::nullopt);

  /// Returns what finds the robot beside the route.
  [[nodiscard]] const RouteFollower& follower() const noexcept { return follower_; }

 private:
  [[nodiscard]] std::span<const Pose2> poses() const { return follower_.tracker().lines().poses(); }
  void start_at(Point2 place);

  RouteDriverOptions options_;
  RouteFollower follower_;
  std::optional<PathFollower> path_;  // from the robot's first place on
  double start_m_ = 0.0;              // along the route
  double length_m_ = 0.0;
  std::optional<Pose2> odometry_;  // of the step before
  double blind_m_ = 0.0;           // driven since the last fix
  int searches_ = 0;
};

/// Returns "searching", "driving", "arrived" or "lost".
[[nodiscard]] std::string_view name_of(RouteDriver::State state);

}  // namespace panonav
