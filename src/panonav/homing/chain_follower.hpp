#pragma once

#include <cstddef>
#include <optional>

#include "panonav/core/options.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/homing/snapshot_chain.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

enum class ChainDirection { forward, back };

struct ChainFollowerOptions {
  /// The robot continues to the next snapshot where the vector to the present one is shorter than
  /// this, in units of R.
  double switch_length = 0.1;
  /// A vector that points farther from where odometry expects the snapshot is not followed.
  double mistrust_rad = 1.0;
  /// The same for the heading that the compass finds, at any distance: odometry drifts less between
  /// two snapshots.
  double mistrust_heading_rad = 0.5;
  /// Nearer than this to where odometry expects the snapshot, vectors are followed in any
  /// direction, because the drift of odometry dominates there.
  double near_m = 0.4;
  /// The robot is lost after this distance without reaching a snapshot.
  double longest_unseen_m = 10.0;
};
void visit_options(ChainFollowerOptions& options, OptionVisitor& visitor);

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
  HomeVector vector;       ///< to the target
  bool by_odometry = false;
};

/// Repeats a route: homes to one snapshot after the other, in the order of recording or back. It
/// begins with the snapshot that is most similar to the first view. It continues to the next
/// snapshot where the present one is near (by the vector's length), or where the view has become
/// more similar to the next one, so that a snapshot that was passed is not searched for. Odometry
/// since the last snapshot is the second opinion, because it drifts little over that distance: a
/// vector that contradicts it is not followed, a snapshot is not near while odometry expects more
/// than half of the distance still to go, and a snapshot that is not found within three times the
/// expected steps is skipped. The last snapshot is reached by a `HomingPursuit`.
class ChainFollower {
 public:
  /// Throws OptionError, ContractError as `validate(chain)`.
  ChainFollower(SnapshotChain chain, ChainDirection direction,
                const ChainFollowerOptions& options = {}, const HomingPursuitOptions& pursuit = {},
                const FourierHomingOptions& vector = {});

  /// The robot moved by `moved` since the last view (robot_old_from_robot_new, by its odometry; of
  /// no meaning for the first view). Throws ContractError as `home_vector`.
  [[nodiscard]] ChainDecision decide(const HomingView& current, const Pose2& moved);

  [[nodiscard]] const SnapshotChain& chain() const noexcept { return chain_; }

 private:
  [[nodiscard]] bool is_last(std::size_t target) const noexcept;
  [[nodiscard]] std::size_t next(std::size_t target) const noexcept;
  [[nodiscard]] Pose2 target_from_next() const;
  [[nodiscard]] bool contradicts_odometry(const HomeVector& vector) const noexcept;
  void aim_at_next(const Pose2& target_from_robot);
  [[nodiscard]] const HomingView& view(std::size_t i) const { return chain_.snapshots[i].view; }
  [[nodiscard]] ChainDecision approach_last(const HomingView& current);

  SnapshotChain chain_;
  ChainDirection direction_;
  ChainFollowerOptions options_;
  HomingPursuitOptions pursuit_options_;
  FourierHomingOptions vector_;
  std::optional<std::size_t> target_;       // empty: no view yet
  std::optional<Pose2> target_from_robot_;  // by odometry; unknown on the way to the first
  double way_m_ = 0.0;                      // to the target, when it became the target
  int steps_to_target_ = 0;
  int max_steps_to_target_ = 0;
  double unseen_m_ = 0.0;  // since the last snapshot that was reached
  std::optional<HomingPursuit> pursuit_;
};

}  // namespace panonav
