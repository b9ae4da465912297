#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/chain_code.hpp"
#include "panonav/route/packed_snapshot.hpp"

namespace panonav {

void visit_options(ChainOdometry& odometry, OptionVisitor& visitor);

/// A node of a chain: a way point, or the place of a snapshot.
struct ChainNode {
  Point2 position;                     ///< in the frame of the recording's odometry
  std::vector<std::uint8_t> snapshot;  ///< as from `pack_snapshot`; empty: way point
  bool is_fine = false;                ///< the snapshot has the shape of `make_fine`

  /// True for the place of a snapshot, false for a way point.
  [[nodiscard]] bool has_snapshot() const noexcept { return !snapshot.empty(); }
  friend bool operator==(const ChainNode&, const ChainNode&) = default;
};

/// A route as a few small snapshots, with straight legs by odometry between them. All snapshots are
/// rotated to the heading 0 of the recording's odometry, so a leg needs no heading: distance,
/// direction and the kind of its end take 3 bytes. Holds what the packed form says, to the bit.
/// The first and the last node have a snapshot; the first one is fine.
class SnapshotChain {
 public:
  /// Longest leg, in metres: the distance has 11 bits and steps of 1 cm, the direction 11 bits.
  static constexpr double max_leg_m = 20.47;

  /// Makes an empty chain. Throws OptionError.
  explicit SnapshotChain(const SnapshotShape& shape = {},
                         const std::optional<ElevationBand>& elevations = std::nullopt,
                         const ChainOdometry& odometry = {});

  /// Appends a node at a position in the frame of the odometry; rounding errors of legs do not add
  /// up. `view`: at heading 0, reduced to the shape of snapshots; nullopt: a way point. Throws
  /// ContractError if the leg is longer than `max_leg_m` or not finite, for a first node that is a
  /// way point, and as `pack_snapshot`.
  void append(Point2 position, const std::optional<HomingView>& view);

  /// Replaces the snapshot of the last node by a fine one, as at the end of a route. Throws
  /// ContractError if there is no snapshot, and as `pack_snapshot`.
  void refine_last(const HomingView& view);

  /// Sets what was learnt, rounded as in the packed form, to 0.4 %. Throws ContractError on a value
  /// beyond its range.
  void set_model(const ChainModel& model);

  /// Size of the snapshots that are not fine.
  [[nodiscard]] const SnapshotShape& shape() const noexcept { return shape_; }
  /// Elevations of the rows of the views; nullopt: unknown.
  [[nodiscard]] const std::optional<ElevationBand>& elevations() const noexcept {
    return elevations_;
  }
  /// Errors of the odometry on which the chain relies between snapshots.
  [[nodiscard]] const ChainOdometry& odometry() const noexcept { return odometry_; }
  /// Values learnt while recording.
  [[nodiscard]] const ChainModel& model() const noexcept { return model_; }
  /// Returns the values that the packed form says once for all nodes.
  [[nodiscard]] ChainHeader header() const noexcept;
  /// All nodes in the order of the recording.
  [[nodiscard]] std::span<const ChainNode> nodes() const& noexcept { return nodes_; }
  std::span<const ChainNode> nodes() const&& = delete;  // would dangle
  /// The view of a node with a snapshot. Throws ContractError for another node.
  [[nodiscard]] HomingView view(std::size_t node) const;

  [[nodiscard]] std::size_t snapshots() const noexcept;  ///< Number of snapshots.
  [[nodiscard]] double length_m() const noexcept;        ///< Sum of all legs.
  /// Number of bytes of the packed form over the length; 0 if the length is 0.
  [[nodiscard]] double bytes_per_100_m() const;

  /// Returns the packed form: a header of 23 bytes, the first snapshot, then for each leg 3 bytes
  /// and the snapshot at its end, if there is one. Throws ContractError on a chain that is empty
  /// or ends with a way point.
  [[nodiscard]] std::vector<std::uint8_t> pack() const;
  /// Unpacks a chain. Throws ContractError on bytes that `pack` does not write.
  [[nodiscard]] static SnapshotChain unpack(std::span<const std::uint8_t> bytes);

  friend bool operator==(const SnapshotChain&, const SnapshotChain&) = default;

 private:
  SnapshotShape shape_;
  std::optional<ElevationBand> elevations_;
  ChainOdometry odometry_;
  ChainModel model_;
  std::vector<ChainNode> nodes_;
};

}  // namespace panonav
