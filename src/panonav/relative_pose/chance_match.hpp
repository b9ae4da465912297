#pragma once

#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Match of two views, compared with how well one of them matches noise. Any two views
/// correlate at the best of all turns and displacements, so a correlation alone shows nothing.
struct ChanceMatch {
  /// Sum of the correlations of both home vectors, there and back, -2 .. 2.
  double match = 0.0;
  double chance = 0.0;  ///< mean of the same over views of noise with the spectrum of the current
  double deviation = 0.0;  ///< standard deviation of the same

  /// True if noise would match as well in less than 1 of 100 cases: the views have something in
  /// common. False for views without structure, and where all noise matches equally, as with one
  /// frequency.
  [[nodiscard]] bool is_beyond_chance() const noexcept;
  /// Probability that the home vector points home within 45 degrees, 0 .. 1, by the number of
  /// deviations by which the match exceeds chance. Learnt once from views of built-in scenes, as
  /// many from up to 0.3 m, 1 m, 3 m, 6 m and from other scenes (docs/decisions.md). Too high in
  /// places that repeat themselves, which look the same from several metres.
  [[nodiscard]] double direction_probability() const noexcept;
};

/// Matches `home` with `current` and with 40 views of noise made of it: each frequency of its
/// vertical structure is rotated by a random angle, which keeps the spectrum in both directions and
/// the energy of each row. Rows are averaged to 16 bands first. The heading of either robot changes
/// nothing but rounding; seeds are fixed. Throws as `home_vector`. Cost: that of 82 home vectors of
/// 16 rows, some milliseconds.
[[nodiscard]] ChanceMatch compare_with_chance(const HomingView& home, const HomingView& current,
                                              const FourierHomingOptions& options = {});

}  // namespace panonav
