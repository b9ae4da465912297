#pragma once

#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Match of two views, compared with the matches of one of them with noise. Any two views correlate
/// at the best of all turns and displacements, so a correlation alone does not show that they are
/// related.
struct ChanceMatch {
  /// Sum of the correlations of both home vectors, there and back, -2 .. 2.
  double match = 0.0;
  double chance = 0.0;     ///< mean match with noise that has the spectrum of the current view
  double deviation = 0.0;  ///< standard deviation of the matches with noise

  /// True if noise would match as well in fewer than 1 of 100 cases, so that the views have
  /// something in common. False for views without structure, or if all noise matches equally
  /// well, as with one frequency.
  [[nodiscard]] bool is_beyond_chance() const noexcept;
  /// Probability, 0 .. 1, that the home vector points home within 45 degrees, from the number of
  /// deviations by which the match exceeds chance. Learnt from views of built-in scenes: equally
  /// many from up to 0.3 m, 1 m, 3 m and 6 m, and from other scenes (docs/decisions.md). Too high
  /// in repetitive places, whose views look the same over several metres.
  [[nodiscard]] double direction_probability() const noexcept;
};

/// Matches `home` with `current` and with 40 views of noise made from `current`: each vertical
/// pattern of each frequency is rotated by a random angle, which keeps the spectrum in both
/// directions and the energy of each row. Rows are averaged to 16 bands first. Headings of the
/// robots affect only rounding; seeds are fixed. Throws as `home_vector`. Cost: that of 82 home
/// vectors of 16 rows, some milliseconds.
[[nodiscard]] ChanceMatch compare_with_chance(const HomingView& home, const HomingView& current,
                                              const FourierHomingOptions& options = {});

}  // namespace panonav
