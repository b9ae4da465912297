#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/snapshot_chain.hpp"

namespace panonav {

/// Size of a home area.
struct HomeAreaOptions {
  int max_bytes = 1000;  ///< of the packed area, 200 .. 1,000,000
  friend bool operator==(const HomeAreaOptions&, const HomeAreaOptions&) = default;
};
void visit_options(HomeAreaOptions& options, OptionVisitor& visitor);

/// A view of a learning walk that is no snapshot, and the home vector that the area gives there.
struct HeldOutView {
  Pose2 pose;                         ///< in the frame of the area
  std::optional<Point2> home_vector;  ///< along the axes of the area, in metres; nullopt: none
};

/// The surroundings of a home.
struct HomeArea {
  /// Snapshots and their places; the first one is home, at the origin. In the frame of the chain,
  /// home was seen at heading 0.
  SnapshotChain chain;
  std::vector<HeldOutView> held_out;  ///< by which the snapshots were chosen
  std::size_t returns = 0;            ///< times that the walk was seen to pass home

  /// Mean cosine of the angle between the home vectors and the true ones, over the views farther
  /// than 0.5 m from home; views without home vector count as 0. 0 without such views.
  [[nodiscard]] double homeward_component() const;
};

/// Learns the surroundings of a home from a walk that begins there and passes it now and then, as
/// bees do it. The error of odometry when a view shows that the walk is at home again is shared out
/// along the path since the last time, so that constant drift cancels. Every other view may become
/// a snapshot; the home vectors of the rest decide which: the next snapshot is the one that
/// improves them most, until the bytes are used up or none does. All snapshots are fine, unless
/// more snapshots that are not improve the home vectors; that of home always is.
///
/// Memory: one reduced view for each 0.1 m of the path.
class HomeAreaLearner {
 public:
  /// Throws OptionError; ContractError if the bytes are too few for one snapshot.
  explicit HomeAreaLearner(const SnapshotShape& shape = {}, const HomeAreaOptions& options = {});

  /// Adds a view after the motion `moved` (robot_old_from_robot_new, by odometry; ignored for the
  /// first view, which is home). Throws ContractError as `ChainRecorder::add`.
  void add(const HomingView& view, const Pose2& moved);

  /// Learns the area. Throws ContractError if there was no view. Cost: two home vectors for each
  /// pair of at most 400 views, half a second; twice that where the bytes run out.
  [[nodiscard]] HomeArea finish(Executor& executor) const;

 private:
  struct WalkedView {
    HomingView view;  // as seen, not turned
    Pose2 pose;       // by odometry, from home
    double path_m = 0.0;
  };
  struct Return {
    std::size_t index = 0;  // of the view
    Pose2 pose;             // by the home vector
  };
  [[nodiscard]] std::vector<Return> find_returns(double typical_distance_m) const;
  [[nodiscard]] double estimate_typical_distance_m() const;
  [[nodiscard]] std::vector<Pose2> correct_poses(const std::vector<Return>& returns) const;

  SnapshotShape shape_;
  HomeAreaOptions options_;
  std::vector<WalkedView> views_;
  Pose2 pose_;           // of the last view, by odometry
  double path_m_ = 0.0;  // of all motions
};

}  // namespace panonav
