#pragma once

#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

/// Part of a panorama that a scanline is cut from.
struct HorizonScanlineOptions {
  int columns = 360;  ///< of the line: a byte a degree [Y03 section 2.2]
  /// Elevation up to which rows are averaged. Light in the plane of the horizon goes straight from
  /// place to place, light above and below does not: keep it narrow.
  double half_band_rad = 0.0131;
  friend bool operator==(const HorizonScanlineOptions&, const HorizonScanlineOptions&) = default;
};
void visit_options(HorizonScanlineOptions& options, OptionVisitor& visitor);

/// Returns the horizon scanline: the view in the plane of the camera [Y03 section 2.2]: `columns`
/// values from column 0, straight ahead, counter-clockwise. Rows within the band are averaged, or
/// the two next to the horizon interpolated where the band holds none; without elevations all rows
/// count as on the horizon. Columns are averaged where the panorama has more than the line,
/// interpolated where it has fewer. Throws OptionError, and ContractError when the horizon lies
/// outside the panorama.
[[nodiscard]] std::vector<float> horizon_scanline(const Panorama& panorama,
                                                  const HorizonScanlineOptions& options = {});

/// Smooths a closed line by a Gaussian of this standard deviation in columns; below 0.3 the line
/// does not change. Cost: 3 sigma multiplications a column.
[[nodiscard]] std::vector<float> smooth_line(std::span<const float> line, double sigma);

}  // namespace panonav
