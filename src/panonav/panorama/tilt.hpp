#pragma once

#include <optional>

#include "panonav/geometry/pose2.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Tilt of the camera's axis against the vertical: first about the robot's x axis (positive lowers
/// the right side), then about its y axis (positive lowers the front), right-handed [REP 103].
struct Tilt {
  double roll_rad = 0.0;   ///< about x, within the range of `validate`
  double pitch_rad = 0.0;  ///< about y, within the range of `validate`
  friend bool operator==(const Tilt&, const Tilt&) = default;
};

/// Largest accepted tilt, in rad: with more, too small a band of elevations remains visible at all
/// azimuths.
inline constexpr double max_tilt_rad = 0.5235987755982988;  // 30 degrees

/// True if the band reaches from pole to pole.
[[nodiscard]] bool is_whole_sphere(const ElevationBand& band) noexcept;

/// Throws ContractError unless both angles are at most `max_tilt_rad`, or 180 degrees in images
/// with the elevations `seen` of the whole sphere.
void validate(const Tilt& tilt, const std::optional<ElevationBand>& seen = std::nullopt);

/// Returns the direction in the level frame of what a tilted robot sees in direction `seen`.
[[nodiscard]] Direction3 level_direction(const Direction3& seen, const Tilt& tilt) noexcept;
/// Returns the direction in which a tilted robot sees what is in direction `level` of the level
/// frame: the inverse of `level_direction`.
[[nodiscard]] Direction3 tilt_direction(const Direction3& level, const Tilt& tilt) noexcept;

/// Levels a panorama: computes the view of the robot with its axis vertical, at the same heading
/// and place. `seen` is rotated by the inverse of the tilt into a panorama of `rows` rows in
/// `band`, interpolated linearly between four values. `seen` may cover more elevations than `band`,
/// to fill more of the result; directions outside `seen` take its nearest row. Without tilt and
/// with the same shape and band the result is a copy. Throws ContractError where the elevations of
/// `seen` are unknown or the tilt is too large. Cost: 0.37 ms for 80 x 512 (docs/performance.md).
[[nodiscard]] Panorama level_panorama(const Panorama& seen, const Tilt& tilt, int rows,
                                      const ElevationBand& band);
/// Levels a panorama in the band and with the rows of `seen`. Where its elevations are unknown, a
/// tilt of up to half a degree is tolerated.
[[nodiscard]] Panorama level_panorama(const Panorama& seen, const Tilt& tilt);

}  // namespace panonav
