#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav::lab {

/// A view memorised along a route.
struct Snapshot {
  HomingView view;
  /// Distance from the start of the route, by the odometry of the recording.
  double travelled_m = 0.0;
  /// Pose of the robot at this snapshot in the frame of the robot at the previous one, by the same
  /// odometry; identity for the first snapshot. Only an approximate hint of where the next snapshot
  /// is.
  Pose2 previous_from_this;
  friend bool operator==(const Snapshot&, const Snapshot&) = default;
};

/// A route as a few snapshots in the order of recording. Homing reaches each snapshot from its
/// neighbours, in both directions.
using SnapshotChain = std::vector<Snapshot>;

/// Returns the distance along the route from the first to the last snapshot; 0 for fewer than two
/// snapshots.
[[nodiscard]] double chain_length_m(const SnapshotChain& chain) noexcept;

/// Returns the size of the chain in bytes divided by its length; 0 if the length is 0. A snapshot
/// takes two floats per row and frequency of its view, without the mean [S06 section 4.4], and four
/// floats for odometry.
[[nodiscard]] double bytes_per_metre(const SnapshotChain& chain) noexcept;

/// Memorises a route while the robot drives it, and takes the next snapshot before homing between
/// it and the last one would fail. A candidate view is accepted if its home vector to the last
/// snapshot points back along the path, and the home vectors to it from all views in between point
/// forward, each within a tolerance of the direction by odometry. The spacing thus adapts to the
/// catchment areas: wide in a hall, narrow in a doorway.
///
/// Memory: the views since the last snapshot, one per 0.1 m. Cost per view: one home vector for
/// each of these.
class ChainRecorder {
 public:
  /// Sets the largest distance between snapshots along the path.
  explicit ChainRecorder(double max_spacing_m = 5.0);

  /// Adds a view after the motion `moved` (robot_old_from_robot_new, by its odometry; ignored for
  /// the first view). Returns the number of snapshots in the chain. Throws ContractError on a view
  /// whose shape differs from that of the previous views.
  std::size_t add(const HomingView& view, const Pose2& moved);

  /// Returns the chain recorded so far, ending with the last view; empty if there was no view.
  [[nodiscard]] SnapshotChain finish() const;

 private:
  // A view since the last snapshot, with its pose in the frame of the robot at that snapshot.
  struct StoredView {
    HomingView view;
    Pose2 snapshot_from_this;
    double path_m = 0.0;  // distance driven since the snapshot
  };
  [[nodiscard]] bool can_home_to_and_from(const StoredView& candidate) const;
  void take_snapshot(std::size_t index);

  double max_spacing_m_;
  SnapshotChain chain_;
  std::vector<StoredView> stored_views_;  // the first element is the last snapshot itself
  // Pose and distance driven since the last snapshot, also after views that are not stored.
  Pose2 snapshot_from_robot_;
  double segment_length_m_ = 0.0;
};

enum class ChainDirection { forward, back };

enum class ChainState {
  following,
  finished,  ///< homing stopped at the last snapshot, whose view is similar
  lost,      ///< homing stopped elsewhere, or no snapshot was reached for too long
};

/// The next motion of the robot after a view.
struct ChainDecision {
  ChainState state = ChainState::following;
  std::size_t target = 0;  ///< snapshot to which the robot is homing
  double turn_rad = 0.0;   ///< direction of motion in the current robot frame
  double advance_m = 0.0;  ///< distance of motion; 0 unless following
};

/// Repeats a route: homes to one snapshot after the other, in the order of recording or back. It
/// begins with the snapshot that is most similar to the first view. It continues to the next one if
/// the present one is near (by the vector's length) or is less similar to the current view than the
/// next one.
///
/// Odometry since the last snapshot checks the views: a vector that contradicts it is not followed,
/// a snapshot is not accepted as near while odometry expects more than half of the distance to
/// remain, and a snapshot that is not found within three times the expected steps is skipped. A
/// `HomingPursuit` approaches the last snapshot.
class ChainFollower {
 public:
  /// Throws OptionError, and ContractError on an empty chain.
  ChainFollower(SnapshotChain chain, ChainDirection direction,
                const HomingPursuitOptions& pursuit = {});

  /// Decides the next motion after the motion `moved` since the last view
  /// (robot_old_from_robot_new, by its odometry; ignored for the first view). Throws
  /// ContractError as `home_vector`.
  [[nodiscard]] ChainDecision decide(const HomingView& current, const Pose2& moved);

 private:
  [[nodiscard]] bool is_last(std::size_t target) const noexcept;
  [[nodiscard]] std::size_t next_snapshot(std::size_t target) const noexcept;
  void start_at_most_similar_snapshot(const HomingView& current);
  bool aim_at_next_if_reached(const HomingView& current, const HomeVector& vector);
  std::optional<ChainDecision> follow_odometry_if_needed(const HomeVector& vector);
  [[nodiscard]] bool contradicts_odometry(const HomeVector& vector) const noexcept;
  void aim_at_next(const Pose2& target_from_robot);
  [[nodiscard]] ChainDecision approach_last(const HomingView& current);

  SnapshotChain chain_;
  ChainDirection direction_;
  HomingPursuitOptions pursuit_options_;
  std::optional<std::size_t> target_;       // nullopt before the first view
  std::optional<Pose2> target_from_robot_;  // by odometry; nullopt until a snapshot is reached
  double segment_length_m_ = 0.0;           // distance to the target when it was chosen
  int steps_to_target_ = 0;
  int max_steps_to_target_ = 0;
  double unseen_distance_m_ = 0.0;  // distance driven since the last snapshot that was reached
  std::optional<HomingPursuit> pursuit_;
};

}  // namespace panonav::lab
