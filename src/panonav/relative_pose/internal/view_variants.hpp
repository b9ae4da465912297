#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Averages the rows of a view to at most `max_bands` bands.
[[nodiscard]] HomingView average_to_bands(const HomingView& view, int max_bands);

/// Returns the rows first .. last - 1 of a view, with their elevations. The caller guarantees that
/// they are in the view.
[[nodiscard]] HomingView select_rows(const HomingView& view, int first, int last);

/// Returns the view with its columns in reverse order: a place that does not exist, with the same
/// floor, ceiling, light and textures.
[[nodiscard]] HomingView mirror(const HomingView& view);

/// Generator of noise with the spectrum of a view. A cosine transform over the rows splits each
/// frequency into vertical patterns, each of which is rotated by a random angle. This keeps the
/// spectrum in both directions and the energy of each row. The view must outlive the generator.
class NoiseGenerator {
 public:
  explicit NoiseGenerator(const HomingView& view);
  /// Returns a view of noise; the same random engine gives the same view.
  [[nodiscard]] HomingView sample_view(Random random) const;

 private:
  const HomingView& view_;
  std::size_t rows_;
  std::vector<float> patterns_;                // by pattern, then row
  std::vector<std::complex<float>> spectrum_;  // by frequency from 1 on, then pattern
  std::vector<float> energy_;                  // by row
};

}  // namespace panonav
