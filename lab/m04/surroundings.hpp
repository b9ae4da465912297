#pragma once

#include <array>
#include <cstddef>

#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// Number of directions in which shapes are compared, counter-clockwise from x; each represents the
/// sector of 45 degrees around it.
inline constexpr std::size_t shape_directions = 8;
using Directional = std::array<double, shape_directions>;

/// Free distance and parallax in each direction around a floor position.
struct Surroundings {
  /// Harmonic mean of the free distance, over the azimuths of the sector and the heights 0.3, 0.6
  /// and 0.9 m.
  Directional free_m{};
  /// Relative distance in this direction for equal parallax: a step in direction theta shifts a
  /// thing in direction phi at distance d by |sin(phi - theta)| / d. The inverse of the mean shift.
  Directional parallax_m{};
};
[[nodiscard]] Surroundings measure_surroundings(const simulation::PlaceRecording& place,
                                                Point2 position);

/// Predicts, to first order, how far the robot can move from `pose` in each direction before the
/// magnitudes of the first `components` change by a fixed amount. The scene's distances give the
/// parallax shift of each pixel; the shift times the brightness gradient is Fourier transformed and
/// projected onto each magnitude. Only ratios between directions are meaningful. Directions are in
/// the scene's frame. Throws ContractError on a view without elevations.
[[nodiscard]] Directional predict_extents(const simulation::PlaceRecording& place,
                                          const Pose2& pose, const Panorama& view, int components);

/// Returns the index of the sector that contains a direction: 0 .. shape_directions - 1.
[[nodiscard]] std::size_t find_sector(double azimuth_rad);

}  // namespace panonav::lab
