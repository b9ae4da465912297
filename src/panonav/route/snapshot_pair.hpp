#pragma once

#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/chain_code.hpp"

namespace panonav {

/// A snapshot compared with a view from another place; both are turned to heading 0.
struct SnapshotPair {
  double distance_m = 0.0;  ///< by odometry
  double length = 0.0;      ///< length of the home vector, in units of R
  double difference = 0.0;  ///< difference of the images
  double confidence = 0.0;  ///< confidence of the home vector
  bool is_right = false;    ///< true if the home vector points to the snapshot
};

/// Nearer views are not compared, because noise dominates the direction of their home vector.
inline constexpr double min_compared_m = 0.15;
/// Home vectors over longer distances say nothing of the typical distance of things.
inline constexpr double max_compared_m = 3.0;

/// True if a home vector in this direction leads to the snapshot: it is at most 0.6 rad off.
[[nodiscard]] bool is_right_direction(double direction_rad, Point2 from, Point2 snapshot);

/// Compares a view with a snapshot, at headings that are at most 0.8 rad apart, as far as that of a
/// follower may be off. Cost: two home vectors.
[[nodiscard]] SnapshotPair compare_with_snapshot(const HomingView& snapshot, Point2 snapshot_place,
                                                 const HomingView& view, Point2 from);

/// Learns the values of a chain from compared pairs. `reaches_m`: for some snapshots, the distance
/// up to which home vectors to it are right.
[[nodiscard]] ChainModel learn_chain_model(std::span<const SnapshotPair> pairs,
                                           std::span<const double> reaches_m);

}  // namespace panonav
