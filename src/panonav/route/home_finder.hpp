#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/chain_follower.hpp"
#include "panonav/route/snapshot_chain.hpp"

namespace panonav {

/// Steps of a robot that finds home, and errors of its odometry beyond those of `OdometryNoise`.
struct HomeFinderOptions {
  double max_step_m = 0.3;  ///< longest motion between two views, > 0
  double error_factor =
      2.5;  ///< radius of the search, in standard deviations of the position, >= 1
  /// Typical drift that odometry does not see, as by wind, as a part of the travelled distance,
  /// 0 .. 1.
  double drift = 0.1;
  /// Standard deviation of a constant drift of the heading, in rad for each metre, 0 .. 1.
  double heading_drift_rad_per_m = 0.002;
  friend bool operator==(const HomeFinderOptions&, const HomeFinderOptions&) = default;
};
void visit_options(HomeFinderOptions& options, OptionVisitor& visitor);

/// Pose by odometry, and what its errors are known to be, as an extended Kalman filter.
class DriftingPose {
 public:
  static constexpr int states = 6;  ///< x, y, heading; drift for each metre in x, y and heading

  /// A robot at home, at heading 0.
  DriftingPose(const OdometryNoise& noise, const HomeFinderOptions& options);

  /// Predicts the pose after a motion by odometry.
  void move(const Pose2& moved);
  /// Corrects the estimate by a pose whose errors have these standard deviations.
  void correct(const Pose2& measured, double deviation_m, double deviation_rad);
  /// Squared Mahalanobis distance of such a pose from the estimate, with 3 degrees of freedom.
  [[nodiscard]] double mismatch(const Pose2& measured, double deviation_m,
                                double deviation_rad) const;

  [[nodiscard]] Pose2 pose() const;            ///< area_from_robot
  [[nodiscard]] Point2 drift_m_per_m() const;  ///< for each metre, along the axes of the area
  [[nodiscard]] double deviation_m() const;    ///< of the position, in the worst direction
  [[nodiscard]] double deviation_rad() const;  ///< of the heading

 private:
  OdometryNoise noise_;
  std::array<double, states> state_{};
  std::array<double, states * states> covariance_{};
};

/// Leads a robot home that left it some way ago, by odometry. Where the robot may be in the home
/// area, views are compared with the snapshots there; the one of the greatest confidence gives the
/// pose, and on the way out the drift that odometry does not see. Where odometry is uncertain, a
/// pose is a hypothesis, which views confirm or refute. Without one the robot searches along a
/// spiral around home, up to the error of odometry. Where the way home is blocked, it tries again
/// from the places of other snapshots. The last metre is led by a `ChainFollower` of the snapshot
/// at home; the robot has arrived if that says so and the pose agrees.
class HomeFinder {
 public:
  /// The robot is at home, at the heading of the learning walk's first view. Throws OptionError;
  /// ContractError on an area without snapshots.
  explicit HomeFinder(SnapshotChain area, const OdometryNoise& noise = {},
                      const HomeFinderOptions& options = {});

  /// Adds a motion by odometry (robot_old_from_robot_new). Throws ContractError if not finite.
  void move(const Pose2& moved);
  /// True if the robot may be in the home area, so that a view would be compared.
  [[nodiscard]] bool may_be_near() const;
  /// Compares a view with the area. Throws ContractError as `ChainRecorder::add`. Cost: two home
  /// vectors for each snapshot.
  void see(const HomingView& view);
  /// Decides the next motion on the way home, after the last view if there was one since the last
  /// motion. The target is the first node. After `arrived` or `lost` every decision is the same.
  [[nodiscard]] ChainDecision decide();

  /// The estimated pose in the frame of the area.
  [[nodiscard]] Pose2 area_from_robot() const { return estimate().pose(); }
  /// Standard deviation of the position in its worst direction, in metres.
  [[nodiscard]] double deviation_m() const { return estimate().deviation_m(); }
  /// Estimated drift that odometry does not see, for each metre, along the axes of the area.
  [[nodiscard]] Point2 drift_m_per_m() const { return estimate().drift_m_per_m(); }
  /// The area.
  [[nodiscard]] const SnapshotChain& area() const noexcept { return area_; }

 private:
  struct Fix {
    Pose2 pose;
    double deviation_m = 0.0;
    double deviation_rad = 0.0;
  };
  struct Hypothesis {
    DriftingPose pose;
    double prior_log_odds = 0.0;  // odds of its first pose by odometry
    double log_odds = 0.0;
    double since_fix_m = 0.0;
    double since_test_m = 0.0;
  };
  [[nodiscard]] const DriftingPose& estimate() const {
    return hypothesis_ ? hypothesis_->pose : by_odometry_;
  }
  [[nodiscard]] std::optional<Fix> find_fix(const DriftingPose& pose, const HomingView& view,
                                            double max_shift_m) const;
  [[nodiscard]] ChainDecision move_to(Point2 place);
  [[nodiscard]] double likely_error_m() const;
  void begin_detour();
  [[nodiscard]] ChainDecision move_home();
  [[nodiscard]] ChainDecision search();
  [[nodiscard]] ChainDecision approach();
  static void correct_pose(DriftingPose& pose, const Fix& fix, double since_m);
  void test_hypothesis();
  void drop_hypothesis();

  SnapshotChain area_;
  HomeFinderOptions options_;
  double nodes_radius_m_ = 0.0;  // distance of the farthest snapshot from home
  double area_radius_m_ = 0.0;   // the same, as far as homing reaches
  DriftingPose by_odometry_;
  double since_fix_m_ = 0.0;
  std::optional<Hypothesis> hypothesis_;
  std::optional<HomingView> view_;  // since the last motion
  ChainState state_ = ChainState::travelling;
  std::unique_ptr<ChainFollower> follower_;  // of the last metre
  Pose2 moved_;                              // since the last decision of the follower
  // The way home, and the detour where it is blocked.
  double min_home_m_ = std::numeric_limits<double>::infinity();  // since the last detour
  int steps_without_progress_ = 0;
  std::optional<std::size_t> detour_node_;
  std::size_t next_detour_ = 1;
  // The search.
  double search_radius_m_ = 0.0;
  double searched_m_ = 0.0;  // radius up to which home was not found
  double spiral_turn_m_ = 0.0;
  double spiral_angle_rad_ = 0.0;
  int steps_to_point_ = 0;
  int failed_ends_ = 0;
};

}  // namespace panonav
