#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav::lab {

/// A view remembered along a route.
struct Snapshot {
  HomingView view;
  /// Distance from the start of the route to here, by the odometry of the recording.
  double travelled_m = 0.0;
  /// Pose of the robot here in the frame of the robot at the snapshot before, by the same odometry;
  /// the first snapshot's is zero. It only hints where the next snapshot is.
  Pose2 previous_from_this;
  friend bool operator==(const Snapshot&, const Snapshot&) = default;
};

/// A route as a few snapshots in the order in which they were taken. Homing reaches each from its
/// neighbours, in both directions.
using SnapshotChain = std::vector<Snapshot>;

/// Returns the distance along the route from the first snapshot to the last; 0 for fewer than two.
[[nodiscard]] double chain_length_m(const SnapshotChain& chain) noexcept;

/// Returns the size of the chain over its length; 0 where it has no length. A snapshot takes two
/// floats for each row and frequency of its view, without the mean [S06 section 4.4], and four for
/// the odometry.
[[nodiscard]] double bytes_per_metre(const SnapshotChain& chain) noexcept;

/// Memorises a route while the robot drives it, and takes the next snapshot where homing between
/// the two would begin to fail. A candidate is good as long as, from each view on the way to it,
/// the home vector to the last snapshot points back along the path and the one to the candidate
/// points forward, both within a tolerance around odometry. The spacing therefore follows the
/// catchment areas: wide in a hall, narrow in a doorway.
///
/// Holds the views since the last snapshot, one each 0.1 m. A view costs two home vectors for each
/// of these.
class ChainRecorder {
 public:
  /// Sets the largest distance of snapshots along the path.
  explicit ChainRecorder(double max_spacing_m = 5.0);

  /// Adds a view after the motion `moved` (robot_old_from_robot_new, by its odometry; of no meaning
  /// for the first view). Returns the number of snapshots in the chain. Throws ContractError on a
  /// view of another shape than those before.
  std::size_t add(const HomingView& view, const Pose2& moved);

  /// Returns the chain so far, with the last view as its end. Empty without any view.
  [[nodiscard]] SnapshotChain finish() const;

 private:
  // View since the last snapshot, in the frame of the robot there.
  struct Passed {
    HomingView view;
    Pose2 snapshot_from_this;
    double way_m = 0.0;  // since the snapshot
  };
  [[nodiscard]] bool is_reachable(const Passed& candidate) const;
  void take_snapshot(std::size_t index);

  double max_spacing_m_;
  SnapshotChain chain_;
  std::vector<Passed> passed_;  // first: the last snapshot itself
  // Pose and way of the last view, where it was passed over, too.
  Pose2 snapshot_from_robot_;
  double way_m_ = 0.0;
};

enum class ChainDirection { forward, back };

enum class ChainState {
  following,
  finished,  ///< homing stopped at the last snapshot, and the place looks like it
  lost,      ///< it stopped elsewhere, or reached no snapshot for too long a way
};

/// The next motion of the robot after a view.
struct ChainDecision {
  ChainState state = ChainState::following;
  std::size_t target = 0;  ///< snapshot that is homed to
  double turn_rad = 0.0;   ///< direction in which to go, in the current robot frame
  double advance_m = 0.0;  ///< how far; 0 unless following
};

/// Repeats a route: homes to one snapshot after the other, in the order of recording or back. It
/// begins with the snapshot that is most similar to the first view. It continues to the next one
/// where the present one is near (by the vector's length) or less similar than the next one.
///
/// Odometry since the last snapshot is the second opinion: a vector that contradicts it is not
/// followed, a snapshot is not near while odometry expects more than half of the distance still to
/// go, and a snapshot that is not found within three times the expected steps is skipped. The last
/// snapshot is reached by a `HomingPursuit`.
class ChainFollower {
 public:
  /// Throws OptionError, and ContractError on an empty chain.
  ChainFollower(SnapshotChain chain, ChainDirection direction,
                const HomingPursuitOptions& pursuit = {});

  /// Decides the next motion after the motion `moved` since the last view
  /// (robot_old_from_robot_new, by its odometry; of no meaning for the first view). Throws
  /// ContractError as `home_vector`.
  [[nodiscard]] ChainDecision decide(const HomingView& current, const Pose2& moved);

 private:
  [[nodiscard]] bool is_last(std::size_t target) const noexcept;
  [[nodiscard]] std::size_t next_snapshot(std::size_t target) const noexcept;
  void start_at_nearest_snapshot(const HomingView& current);
  bool aim_at_next_if_reached(const HomingView& current, const HomeVector& vector);
  std::optional<ChainDecision> follow_odometry_if_needed(const HomeVector& vector);
  [[nodiscard]] bool contradicts_odometry(const HomeVector& vector) const noexcept;
  void aim_at_next(const Pose2& target_from_robot);
  [[nodiscard]] ChainDecision approach_last(const HomingView& current);

  SnapshotChain chain_;
  ChainDirection direction_;
  HomingPursuitOptions pursuit_options_;
  std::optional<std::size_t> target_;       // empty: no view yet
  std::optional<Pose2> target_from_robot_;  // by odometry; unknown on the way to the first
  double way_m_ = 0.0;                      // to the target, when it became the target
  int steps_to_target_ = 0;
  int max_steps_to_target_ = 0;
  double unseen_m_ = 0.0;  // since the last snapshot that was reached
  std::optional<HomingPursuit> pursuit_;
};

}  // namespace panonav::lab
