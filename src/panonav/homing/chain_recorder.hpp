#pragma once

#include <optional>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/homing/snapshot_chain.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {

struct ChainRecorderOptions {
  /// Vectors between a candidate and the last snapshot may be off by this much.
  double direction_tolerance_rad = 0.6;
  /// A snapshot is taken at this share of the distance over which homing worked, so that a robot
  /// beside the route or in other light still reaches it.
  double margin = 0.7;
  double shortest_spacing_m = 0.3;
  double longest_spacing_m = 5.0;
  /// Views nearer to a snapshot are not used for its direction, which is dominated by noise there.
  double near_m = 0.15;
  /// Between the views that are compared; a view nearer to the one before is skipped.
  double view_spacing_m = 0.1;
};
void visit_options(ChainRecorderOptions& options, OptionVisitor& visitor);

/// Memorises a route while the robot drives it, and takes the next snapshot where homing between
/// the two would begin to fail. A candidate is good as long as, from each view on the way to it,
/// the home vector to the last snapshot points back along the path and the one to the candidate
/// points forward, both within the tolerance around odometry. The spacing therefore follows the
/// catchment areas: wide in a hall, narrow in a doorway.
///
/// Holds the views since the last snapshot, at most longest_spacing_m / view_spacing_m of them. A
/// view costs two home vectors for each of these.
class ChainRecorder {
 public:
  /// Throws OptionError.
  explicit ChainRecorder(const ChainRecorderOptions& options = {},
                         const FourierHomingOptions& vector = {});

  /// The robot moved by `moved` (robot_old_from_robot_new, by its odometry; of no meaning for the
  /// first view) and sees `view`. Returns how many snapshots the chain has now. Throws
  /// ContractError on a view of another shape than those before or a step that is not finite.
  std::size_t add(const HomingView& view, const Pose2& moved);

  /// The chain so far, and the place of the last view as its end. Empty chain without any view.
  [[nodiscard]] SnapshotChain finish() const;

 private:
  // A view since the last snapshot, in the frame of the robot there.
  struct Passed {
    HomingView view;
    Pose2 snapshot_from_this;
    double way_m = 0.0;  // since the snapshot
  };
  [[nodiscard]] bool is_reachable(const Passed& candidate) const;
  [[nodiscard]] bool points_from_to(const Passed& from, const Passed& to) const;
  void take_snapshot(std::size_t index);

  ChainRecorderOptions options_;
  FourierHomingOptions vector_;
  SnapshotChain chain_;
  std::vector<Passed> passed_;  // first: the last snapshot itself
  // Pose and way of the last view, where it was passed over, too.
  Pose2 snapshot_from_robot_;
  double way_m_ = 0.0;
};

}  // namespace panonav
