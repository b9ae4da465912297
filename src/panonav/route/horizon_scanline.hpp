#pragma once

#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Options for the part of a panorama from which a scanline is made.
struct HorizonScanlineOptions {
  int columns = 360;  ///< of the line: a byte a degree [Y03 section 2.2]
  /// Largest elevation, up or down, of averaged rows. It should be small, as only light in the
  /// plane of the horizon travels from place to place along the path.
  double half_band_rad = 0.0131;
  friend bool operator==(const HorizonScanlineOptions&, const HorizonScanlineOptions&) = default;
};
void visit_options(HorizonScanlineOptions& options, OptionVisitor& visitor);

/// Returns the horizon scanline: the view in the plane of the camera [Y03 section 2.2]: `columns`
/// values from column 0, straight ahead, counter-clockwise. Rows within the band are averaged; if
/// there are none, the two rows next to the horizon are interpolated. Without elevations all rows
/// are averaged. Columns are averaged where the panorama has more than the line, interpolated where
/// it has fewer. Throws OptionError, and ContractError when the horizon lies outside the panorama.
[[nodiscard]] std::vector<float> horizon_scanline(const Panorama& panorama,
                                                  const HorizonScanlineOptions& options = {});

/// Smooths a closed line by a Gaussian of this standard deviation in columns; below 0.3 the line
/// does not change. Cost: 3 sigma multiplications a column.
[[nodiscard]] std::vector<float> smooth_line(std::span<const float> line, double sigma);

}  // namespace panonav
