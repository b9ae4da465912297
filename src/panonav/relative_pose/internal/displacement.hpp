#pragma once

#include <cstddef>
#include <span>

#include "panonav/relative_pose/home_vector.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// A displacement that is tested before the least squares: none, or one of twelve directions at a
/// sixth, a third, a half or two thirds of R [S06 section 3 tests about 200 within two thirds].
/// Neighbours are at most R / 6 apart radially and 0.35 R along the outermost ring; with the
/// searched frequencies the least squares converge over such distances.
struct Displacement {
  static constexpr int rings = 4;
  static constexpr int directions = 12;
  int ring = 0;  ///< 0: none, else 1 .. rings
  int direction = 0;

  [[nodiscard]] double length() const noexcept;  ///< in units of R
  [[nodiscard]] double direction_rad() const noexcept;
};

/// Highest frequency that the search compares. Half way between two rings, R / 12 from each, its
/// phase is off by at most 8 / 12 rad, well within the linear range.
inline constexpr int max_searched_frequency = 8;

/// Highest frequency of `displace`. A microcontroller that knows the size of its snapshots has no
/// memory for the tables of all others; results do not depend on it.
#ifdef PANONAV_MAX_DISPLACED_FREQUENCY
inline constexpr int max_displaced_frequency = PANONAV_MAX_DISPLACED_FREQUENCY;
#else
inline constexpr int max_displaced_frequency = 63;
#endif

/// Computes the coefficients of the expected image [S06 eq. 3, no turn] for one row: the view at
/// the displacement when all things are at distance R. `from_a`, `from_b`: frequencies 0 ..
/// from_a.size() - 1 of the current view; fills all of `to_a`, `to_b`. Frequency 0 does not change.
/// Throws nothing. Cost: 2 from_a.size() to_a.size() multiplications.
void displace(Displacement displacement, std::span<const float> from_a,
              std::span<const float> from_b, std::span<float> to_a, std::span<float> to_b) noexcept;

/// Computes the tables of `displace` if they are not there yet.
void fill_displacement_tables() noexcept;

/// A displacement and the turn at which the displaced view fits best.
struct BestDisplacement {
  Displacement displacement;
  float turn_rad = 0.0F;  ///< heading of home minus heading of the current view
};

/// Finds the displacement whose expected image differs least from the home view at its best turn
/// within the window: hs_ei [S06 section 2.2] in the Fourier domain. Far displacements must differ
/// a little less than near ones to be chosen. The views are `rows` rows of `frequencies` + 1
/// coefficients each, row after row. Cost: for each row 49 expected images of 8 frequencies; turns
/// are refined only of the few images that may win.
[[nodiscard]] BestDisplacement find_displacement(std::span<const float> home_a,
                                                 std::span<const float> home_b,
                                                 std::span<const float> current_a,
                                                 std::span<const float> current_b, int rows,
                                                 int frequencies, const HeadingWindow& window = {});

/// The start of the least squares of two views, with the heading that fits there.
struct DisplacementStart {
  Displacement displacement;
  double ahead_rad = 0.0;  ///< azimuth from which the displacement's direction is measured
  double turn_rad = 0.0;   ///< heading of home minus heading of the current view
};

/// Finds the displacement between two views after averaging their rows to a few bands: things move
/// up or down by less than a band, and coarse structure suffices. Directions are measured from the
/// maximum of the first frequency of the current view, so that the result does not depend on the
/// robot's heading. `known`: the highest frequency that both have.
[[nodiscard]] DisplacementStart find_displacement_start(const CoefficientView& home,
                                                        const CoefficientView& current, int known,
                                                        const HeadingWindow& window);

}  // namespace panonav
