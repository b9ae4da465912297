#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// An omnidirectional route panorama: the horizon scanlines from the places along a route, one line
/// a place [Y03 section 2.2]. A line has `columns` bytes, from straight ahead counter-clockwise;
/// the heading of its pose is that of straight ahead in the world. Invariant: all poses finite, no
/// two neighbours at the same place, all lines of one length.
class RoutePanorama {
 public:
  /// Smallest distance between successive lines; nearer ones are left out.
  static constexpr double min_step_m = 1e-3;

  /// Throws ContractError unless columns is 16 .. 16384.
  explicit RoutePanorama(int columns = 360);

  /// Appends a line as from `horizon_scanline`, 0 .. 1, clamped and rounded to bytes. Returns false
  /// and stores nothing where the robot has not moved by `min_step_m` since the last line. Throws
  /// ContractError on a wrong length or a value that is not finite.
  bool append(const Pose2& pose, std::span<const float> line);
  /// Appends a line of bytes in the same way.
  bool append(const Pose2& pose, std::span<const std::uint8_t> line);

  /// Number of bytes of a line, over the azimuths of a full turn.
  [[nodiscard]] int columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t size() const noexcept { return poses_.size(); }  ///< Number of lines.
  /// True if there is no line.
  [[nodiscard]] bool empty() const noexcept { return poses_.empty(); }
  /// The pose from which each line was taken, in the route's frame.
  [[nodiscard]] std::span<const Pose2> poses() const& noexcept { return poses_; }
  std::span<const Pose2> poses() const&& = delete;  // would dangle
  /// The bytes of line i, from straight ahead counter-clockwise. The caller guarantees i < size().
  [[nodiscard]] std::span<const std::uint8_t> line(std::size_t i) const& noexcept {
    return std::span(bytes_).subspan(i * static_cast<std::size_t>(columns_),
                                     static_cast<std::size_t>(columns_));
  }
  std::span<const std::uint8_t> line(std::size_t i) const&& = delete;  // would dangle
  [[nodiscard]] double length_m() const;  ///< Path length through all places.

  friend bool operator==(const RoutePanorama&, const RoutePanorama&) = default;

 private:
  int columns_;
  std::vector<Pose2> poses_;
  std::vector<std::uint8_t> bytes_;
};

/// Returns line i as from `horizon_scanline`, 0 .. 1.
[[nodiscard]] std::vector<float> line_values(const RoutePanorama& route, std::size_t i);

/// Returns line i in the world's frame, 0 .. 1: value c is in direction 2 pi c / columns from the
/// world's x axis.
[[nodiscard]] std::vector<float> world_line(const RoutePanorama& route, std::size_t i);

}  // namespace panonav
