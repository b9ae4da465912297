#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/route/snapshot_pair.hpp"

namespace panonav {

/// Spacing of the snapshots of a chain.
struct ChainSpacing {
  double max_spacing_m = 10.0;  ///< largest distance along the path between snapshots, 0.1 .. 20
  /// Bytes that the snapshots of 100 m may take, at least a snapshot every `max_spacing_m`; 0: as
  /// many as homing needs. A smaller number leaves gaps that odometry alone may not bridge.
  double bytes_per_100_m = 0.0;
  friend bool operator==(const ChainSpacing&, const ChainSpacing&) = default;
};
void visit_options(ChainSpacing& spacing, OptionVisitor& visitor);

/// Memorises a route while the robot drives it. The next snapshot is taken as far from the last one
/// as homing reaches and odometry may be trusted: the error of odometry over the way from the one
/// to the other is at most the distance from which the home vectors of all views between them point
/// to the packed snapshot, ahead of it and behind it. So it is wide in a hall and narrow in a
/// doorway. Where the path bends, way points of 3 bytes keep the legs near it.
///
/// Memory: the reduced views since the last snapshot, one per 0.1 m, and 40 bytes for each compared
/// pair of views. Cost per view: about 20 home vectors.
class ChainRecorder {
 public:
  /// Throws OptionError; ContractError if `bytes_per_100_m` is too small for one snapshot every
  /// `max_spacing_m`.
  explicit ChainRecorder(const SnapshotShape& shape = {}, const ChainSpacing& spacing = {},
                         const ChainOdometry& odometry = {});

  /// Adds a view after the motion `moved` (robot_old_from_robot_new, by odometry; ignored for the
  /// first view). Returns the number of snapshots so far. Throws ContractError on a motion that is
  /// not finite, if the view has fewer rows or components than snapshots, or other elevations than
  /// the first one.
  std::size_t add(const HomingView& view, const Pose2& moved);

  /// Returns the chain recorded so far, ending with the last view or one less
  /// than 0.1 m before it; empty if there was no view.
  [[nodiscard]] SnapshotChain finish() const;

 private:
  /// A reduced view since the last snapshot, turned to heading 0.
  struct StoredView {
    HomingView view;
    HomingView snapshot;  // the view as a chain would hold it
    Point2 position;
    double path_m = 0.0;  // since the last snapshot
  };
  [[nodiscard]] double bytes_per_snapshot() const noexcept;
  [[nodiscard]] double min_spacing_m() const noexcept;
  [[nodiscard]] bool can_home(const StoredView& from, const StoredView& to) const;
  [[nodiscard]] bool can_be_reached(std::size_t index) const;
  void take_snapshot(std::size_t index);
  void compare_with_snapshot(std::size_t index);

  ChainSpacing spacing_;
  SnapshotChain chain_;
  std::vector<StoredView> views_;  // the first one is the last snapshot
  std::vector<SnapshotPair> pairs_;
  std::vector<double> reaches_m_;  // one for each snapshot
  std::size_t reachable_ = 0;      // the farthest view that can be the next snapshot; 0: none
  Pose2 odometry_from_robot_;
  double path_m_ = 0.0;  // since the last snapshot
};

}  // namespace panonav
