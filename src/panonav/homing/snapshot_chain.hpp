#pragma once

#include <cstddef>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

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

/// A route as a few snapshots, in the order in which they were taken. Each can be reached by homing
/// from its neighbours, in both directions.
struct SnapshotChain {
  std::vector<Snapshot> snapshots;
  friend bool operator==(const SnapshotChain&, const SnapshotChain&) = default;
};

/// Throws ContractError unless the chain has at least one snapshot, all views have the same rows,
/// components and elevations, travelled_m is finite, begins at or above 0 and never falls, and all
/// poses are finite.
void validate(const SnapshotChain& chain);

/// Size of the chain: for each snapshot the coefficients of its view (`snapshot_bytes`) and four
/// floats for the odometry.
[[nodiscard]] std::size_t chain_bytes(const SnapshotChain& chain) noexcept;

/// Distance along the route from the first snapshot to the last; 0 for fewer than two.
[[nodiscard]] double chain_length_m(const SnapshotChain& chain) noexcept;

/// `chain_bytes` over `chain_length_m`; 0 where the chain has no length.
[[nodiscard]] double bytes_per_metre(const SnapshotChain& chain) noexcept;

}  // namespace panonav
