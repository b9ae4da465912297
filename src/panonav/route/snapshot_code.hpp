#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "panonav/relative_pose/home_vector.hpp"

/// Packed snapshots without heap memory and exceptions, with the same bits on a microcontroller.
/// `pack_snapshot` and `unpack_snapshot` check their arguments and explain the bytes.
namespace panonav {

/// Size of the snapshots of a chain. The defaults take 48 bytes and lose less than 0.01 of the
/// homeward component of the same coefficients as floats (docs/decisions.md).
struct SnapshotShape {
  int rows = 8;        ///< 1 .. 255, from the highest elevation to the lowest
  int components = 6;  ///< k = 0 .. components - 1; 2 .. 64
  int bits = 4;        ///< of a coefficient, 3 .. 8

  /// Number of stored coefficients: a_k and b_k of all rows; b_0 is 0 and not stored.
  [[nodiscard]] std::size_t coefficients() const noexcept {
    return static_cast<std::size_t>(rows) * (2 * static_cast<std::size_t>(components) - 1);
  }
  /// True if all numbers are in their ranges.
  [[nodiscard]] constexpr bool is_valid() const noexcept {
    return rows >= 1 && rows <= 255 && components >= 2 && components <= 64 && bits >= 3 &&
           bits <= 8;
  }
  /// Number of bytes of a snapshot: scales, then coefficients.
  [[nodiscard]] std::size_t bytes() const noexcept;
  friend bool operator==(const SnapshotShape&, const SnapshotShape&) = default;
};
/// Returns the shape of snapshots whose place must be right: coefficients of at least 6 bits. With
/// 4 bits, the place where the home vector vanishes is up to 0.05 R off: half a metre in a hall.
[[nodiscard]] constexpr SnapshotShape make_fine(SnapshotShape shape) noexcept {
  constexpr int fine_bits = 6;
  if (shape.bits < fine_bits) shape.bits = fine_bits;
  return shape;
}
/// Returns the shape of a snapshot that is fine or not.
[[nodiscard]] constexpr SnapshotShape choose_shape(const SnapshotShape& shape,
                                                   bool is_fine) noexcept {
  return is_fine ? make_fine(shape) : shape;
}
/// Packs a view of this shape into `bytes`, which has the size of a snapshot.
void encode_snapshot(const CoefficientView& view, const SnapshotShape& shape,
                     std::span<std::uint8_t> bytes) noexcept;

/// Returns the quantisation step of component k of a snapshot.
[[nodiscard]] float decode_step(std::span<const std::uint8_t> bytes, const SnapshotShape& shape,
                                int k) noexcept;

/// Unpacks a snapshot into rows * components cosines and as many sines, component-major.
void decode_snapshot(std::span<const std::uint8_t> bytes, const SnapshotShape& shape,
                     std::span<float> cosines, std::span<float> sines) noexcept;

}  // namespace panonav
