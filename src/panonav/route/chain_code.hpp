#pragma once

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/home_vector.hpp"
#include "panonav/route/snapshot_code.hpp"

/// The packed form of a chain of snapshots, read without heap memory and exceptions. The bytes may
/// lie in the flash memory of a microcontroller. `SnapshotChain` explains and checks them.
namespace panonav {

/// Largest errors of an odometry on which a chain of snapshots relies between two snapshots.
struct ChainOdometry {
  double distance_error = 0.05;                   ///< of the travelled distance, 0 .. 1
  double heading_error_rad_per_m = 0.0349065850;  ///< >= 0; 2 degrees a metre
  /// Drift that odometry does not see, as by wind, as a part of the travelled distance, 0 .. 1.
  double drift = 0.1;

  /// Returns by how much the position may be off after travelling straight on from a snapshot, by
  /// the errors of both drives, the recorded and the repeated one: the root of the sum of squares.
  [[nodiscard]] double position_error_m(double travelled_m) const noexcept;
  /// Returns by how much the heading may be off, likewise.
  [[nodiscard]] double heading_error_rad(double travelled_m) const noexcept;
  friend bool operator==(const ChainOdometry&, const ChainOdometry&) = default;
};
/// Values that a recorder learns from the surroundings of a route.
struct ChainModel {
  float typical_distance_m = 3.0F;  ///< metres of a home vector of length 1, > 0
  float reach_m = 0.5F;  ///< distance up to which home vectors to most snapshots are right, > 0
  /// Image difference below which are 95 % of the views from beside a snapshot, if these are more
  /// probable there than views from elsewhere along the route; 0 .. 2.
  float arrived_difference = 0.08F;
  /// Confidence of home vectors from which on nine of ten were right within 0.6 rad, -1 .. 1: the
  /// mean of the correlation of the views and of the cosine of the angle between the home vectors
  /// there and back.
  float homing_confidence = 0.8F;
  friend bool operator==(const ChainModel&, const ChainModel&) = default;
};

/// A straight step between two nodes, as its 22 bits say.
struct ChainLeg {
  static constexpr std::size_t bytes = 3;              ///< of the packed form, with the kind of end
  static constexpr std::uint32_t max_distance = 2047;  ///< 11 bits, in centimetres
  static constexpr std::uint32_t directions = 2048;    ///< 11 bits for a full turn
  std::uint32_t distance = 0;                          ///< in centimetres
  std::uint32_t direction = 0;                         ///< counter-clockwise from the x axis

  /// Returns the step along the axes of the chain.
  [[nodiscard]] Point2 step() const noexcept;
};

/// A node of a chain whose snapshot is stored elsewhere.
struct ChainStop {
  Point2 position;                         ///< in the frame of the recording's odometry
  const std::uint8_t* snapshot = nullptr;  ///< nullptr: a way point
  bool is_fine = false;                    ///< the snapshot has the shape of `make_fine`

  /// True for the place of a snapshot, false for a way point.
  [[nodiscard]] bool has_snapshot() const noexcept { return snapshot != nullptr; }
};

/// Values of a chain that all nodes share.
struct ChainHeader {
  static constexpr std::uint32_t magic = 0x4350;  ///< "PC"
  static constexpr std::size_t bytes = 23;        ///< size of the packed header
  /// A step of the packed elevations: 32,767 are a right angle.
  static constexpr double elevation_step_rad = std::numbers::pi / 65'534.0;
  /// Returns a packed elevation.
  [[nodiscard]] static constexpr float elevation_rad(std::int16_t steps) noexcept {
    return static_cast<float>(steps * elevation_step_rad);
  }
  std::uint32_t magic_found = 0;  ///< the first two bytes
  SnapshotShape shape;            ///< of the snapshots that are not fine
  float bottom_rad = 0.0F;        ///< lowest elevation of the rows; unknown if both are 0
  float top_rad = 0.0F;           ///< highest elevation of the rows
  ChainModel model;               ///< learnt while recording
  ChainOdometry odometry;         ///< on which the spacing relies
};

/// The kinds of nodes, as the lowest two bits of a packed leg say them.
enum class ChainNodeKind : std::uint8_t {
  way_point = 0,     ///< a place without a snapshot
  snapshot = 1,      ///< with a snapshot of the chain's shape
  fine_snapshot = 2  ///< with a snapshot of at least six bits a coefficient
};

/// Reads the header. The caller guarantees `ChainHeader::bytes` bytes.
[[nodiscard]] ChainHeader decode_header(std::span<const std::uint8_t> bytes) noexcept;

/// Reads the nodes of a packed chain in their order.
class ChainCursor {
 public:
  /// `bytes` include the header and outlive the cursor and the snapshots of its nodes.
  ChainCursor(std::span<const std::uint8_t> bytes, const SnapshotShape& shape) noexcept
      : rest_(bytes.subspan(ChainHeader::bytes)), shape_(shape) {}

  /// Returns the next node; nullopt if the bytes end before it does.
  [[nodiscard]] std::optional<ChainStop> next() noexcept;
  /// The leg to the node that was read last.
  [[nodiscard]] const ChainLeg& leg() const noexcept { return leg_; }
  /// Number of bytes that are left.
  [[nodiscard]] std::size_t rest() const noexcept { return rest_.size(); }

 private:
  std::span<const std::uint8_t> rest_;
  SnapshotShape shape_;
  ChainLeg leg_;
  Point2 position_;
  bool is_first_ = true;
};

/// A chain whose nodes and snapshots are stored elsewhere.
struct ChainRoute {
  ChainHeader header;                ///< what all nodes share
  std::span<const ChainStop> stops;  ///< in the order of the recording
};

/// Reads a packed chain into `stops`. nullopt unless the bytes begin as a chain does, end with a
/// node, and have at most `stops.size()` nodes, the first and the last with a snapshot.
[[nodiscard]] std::optional<ChainRoute> read_chain(std::span<const std::uint8_t> bytes,
                                                   std::span<ChainStop> stops) noexcept;

}  // namespace panonav
