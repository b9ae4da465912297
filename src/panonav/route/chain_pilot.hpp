#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/approach_steps.hpp"
#include "panonav/relative_pose/home_vector.hpp"
#include "panonav/route/chain_code.hpp"

namespace panonav {

/// The comparison of a view with a snapshot of a chain.
struct SnapshotSight {
  HomeVector vector;        ///< from the view to the snapshot
  double difference = 2.0;  ///< of the images
  /// Mean of the correlation of the views and of the cosine of the angle between the home vectors
  /// from the view to the snapshot and back, -1 .. 1: how probably the vector is right.
  double confidence = -1.0;
};

/// Direction in which a chain is followed.
enum class ChainDirection {
  forward,  ///< as recorded
  back,     ///< from the last snapshot to the first
};

/// The present activity of a robot that follows a chain.
enum class ChainState {
  travelling,  ///< by odometry to the next snapshot
  homing,      ///< to the next snapshot, whose view is similar
  searching,   ///< for a snapshot that was not found where odometry expects it
  arrived,     ///< homing ended at the last snapshot
  lost,        ///< the search ended without a similar view
};

/// The next motion of the robot after a view.
struct ChainDecision {
  ChainState state = ChainState::travelling;  ///< after the view
  std::size_t target = 0;                     ///< node of the snapshot to which the robot moves
  double turn_rad = 0.0;   ///< direction of the motion in the current robot frame
  double advance_m = 0.0;  ///< length of the motion; 0 if arrived or lost
};

/// Steps of a robot that follows a chain.
struct ChainFollowerOptions {
  double max_step_m = 0.3;    ///< longest motion between two views, > 0
  double stop_step_m = 0.02;  ///< homing ends when its steps are shorter than this, > 0
  int max_homing_steps = 40;  ///< of one approach to a snapshot, >= 1
  double error_factor = 1.5;  ///< radius of the search, in errors of the odometry, >= 1
  friend bool operator==(const ChainFollowerOptions&, const ChainFollowerOptions&) = default;
};

/// Repeats a route along a chain of snapshots, without heap memory and exceptions, with the same
/// bits on a microcontroller. The robot travels from snapshot to snapshot by odometry. At each one
/// it homes, which resets the drift of position and heading and shows the systematic errors of the
/// odometry. A snapshot that is not found is searched for along a spiral up to the error of the
/// odometry; without success the robot is lost. It has arrived only where homing ended at a view as
/// similar to the last snapshot as those within half a metre of snapshots while recording, or, in
/// other light, where confident home vectors vanish within 0.35 m of the last snapshot by odometry.
class ChainPilot {
 public:
  /// Returns the size of the workspace that a pilot needs.
  [[nodiscard]] static constexpr std::size_t workspace_size(const SnapshotShape& shape) noexcept {
    return 2 * static_cast<std::size_t>(shape.rows) * static_cast<std::size_t>(shape.components);
  }

  /// The stops, their snapshots and the workspace outlive the pilot. The caller guarantees options
  /// in their ranges, and at least one stop, the first and the last with a snapshot.
  ChainPilot(const ChainRoute& route, std::span<float> workspace, ChainDirection direction,
             const ChainFollowerOptions& options = {}) noexcept
      : route_(route), workspace_(workspace), direction_(direction), options_(options) {}

  /// Decides the next motion after the motion `moved` since the last view
  /// (robot_old_from_robot_new, by odometry; ignored for the first view). `view` has the shape of
  /// the snapshots. The robot starts beside a snapshot, of any heading: the first one of its
  /// direction if the view is similar to it, else the most similar one. After `arrived` or `lost`
  /// every decision is the same.
  [[nodiscard]] ChainDecision decide(const CoefficientView& view, const Pose2& moved) noexcept;

  /// The estimated pose in the frame of the chain, in which snapshots have the heading 0.
  [[nodiscard]] const Pose2& chain_from_robot() const noexcept { return pose_; }

 private:
  [[nodiscard]] CoefficientView snapshot_view(std::size_t node) const noexcept;
  [[nodiscard]] std::optional<std::size_t> next_snapshot(std::size_t node) const noexcept;
  [[nodiscard]] std::size_t step_towards_end(std::size_t node) const noexcept;
  [[nodiscard]] Point2 position(std::size_t node) const noexcept {
    return route_.stops[node].position;
  }
  [[nodiscard]] const ChainOdometry& odometry() const noexcept { return route_.header.odometry; }
  [[nodiscard]] double error_m() const noexcept;
  [[nodiscard]] double path_to_target_m() const;
  [[nodiscard]] SnapshotSight look_at(std::size_t node, const CoefficientView& view,
                                      bool any_heading) noexcept;
  [[nodiscard]] bool is_confident(const SnapshotSight& sight) const;
  [[nodiscard]] Point2 home_from_robot(const HomeVector& vector) const;
  [[nodiscard]] bool agrees_with_odometry(const SnapshotSight& sight) const;
  [[nodiscard]] bool has_converged(const HomeVector& vector, bool has_next) const;

  void start(const CoefficientView& view);
  void aim_at(std::size_t node);
  void fix_pose(const HomeVector& vector);
  void learn_drift(const Pose2& fixed);
  void begin_homing();
  void begin_search();
  [[nodiscard]] Point2 spiral_place(double angle_rad) const noexcept;
  [[nodiscard]] double next_spiral_angle(double angle_rad) const noexcept;
  void fail_approach();
  [[nodiscard]] ChainDecision move_to(Point2 place) const;
  [[nodiscard]] ChainDecision end_with(ChainState state);
  [[nodiscard]] ChainDecision travel(const CoefficientView& view);
  [[nodiscard]] ChainDecision home(const CoefficientView& view);
  [[nodiscard]] ChainDecision search(const CoefficientView& view);

  ChainRoute route_;
  std::span<float> workspace_;
  ChainDirection direction_;
  ChainFollowerOptions options_;
  ChainState state_ = ChainState::travelling;
  bool has_started_ = false;
  // The last comparison of the present view.
  std::optional<SnapshotSight> sight_;
  std::size_t sight_node_ = 0;
  HeadingWindow sight_window_;
  Pose2 pose_;                   // chain_from_robot
  double since_fix_m_ = 0.0;     // distance driven since the last snapshot was reached
  std::size_t target_ = 0;       // node of the next snapshot
  std::size_t way_point_ = 0;    // node to which the robot travels
  double since_target_m_ = 0.0;  // distance driven since the target was chosen
  double expected_path_m_ = 0.0;
  // Systematic errors of the odometry in both drives, for each metre driven.
  Point2 drift_m_per_m_;         // by wind, in the frame of the chain
  double scale_error_ = 0.0;     // relative error of distances
  double turn_rad_per_m_ = 0.0;  // drift of the heading
  Pose2 fixed_pose_;             // at the last snapshot that was reached
  double heading_by_odometry_rad_ = 0.0;
  // The present approach.
  int homing_stage_ = 0;
  int homing_steps_ = 0;
  ApproachSteps approach_;
  double approach_confidence_ = -1.0;  // largest one
  // The present search.
  std::size_t spiral_points_ = 0;  // points in the spiral; 0: there is no search
  double spiral_angle_rad_ = 0.0;  // direction of the present point
  std::size_t search_steps_ = 0;
  double fix_to_search_m_ = 0.0;  // distance driven from the last snapshot until then
  std::size_t spiral_point_ = 0;
  int steps_to_point_ = 0;
  double since_approach_m_ = 0.0;    // distance driven since the last approach failed
  double failed_confidence_ = -1.0;  // largest one of the approaches that failed
};

}  // namespace panonav
