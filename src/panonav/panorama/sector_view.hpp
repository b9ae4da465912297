#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav {

/// The part of a panoramic cylinder that a narrow picture shows, in the projection and angular
/// resolution of a memory's panoramas. Values that the picture does not show are marked, never
/// filled in. Invariant: rows, columns >= 1; both vectors have rows * columns entries.
struct SectorView {
  PanoramaShape panorama;    ///< rows and columns of the whole cylinder
  ElevationBand elevations;  ///< of all rows, as in the memory
  int columns = 0;           ///< columns of the sector, at most those of the cylinder
  /// Azimuth of column 0 in the robot frame. Azimuths grow with the columns (counter-clockwise), by
  /// 2 pi / panorama.columns each.
  double first_azimuth_rad = 0.0;
  std::vector<float> values;          ///< grey 0 .. 1, row-major; 0 where nothing is visible
  std::vector<std::uint8_t> visible;  ///< 1 where the picture shows the value, else 0

  [[nodiscard]] double column_rad() const noexcept;  ///< Azimuth from column to column.
  [[nodiscard]] double row_rad() const noexcept;     ///< Elevation from row to row.
};

/// Returns the azimuth of the columns in which any of these sectors of one cylinder shows anything.
[[nodiscard]] double shown_width(std::span<const SectorView> sectors);

/// Brings a picture of a pinhole camera to the cylinder of a memory: each value is the mean of four
/// points of its solid angle, sampled bilinearly from the picture, which is halved first until its
/// pixels are about as far apart. `tilt`: of the robot with the camera; the sector is level. Colour
/// becomes grey. nullopt if the picture shows nothing of the elevations. Throws ContractError on
/// another model or size, and on a tilt out of range. Cost: about 3 ms for 640 x 480.
[[nodiscard]] std::optional<SectorView> unwarp_sector(ImageView picture, const Camera& camera,
                                                      PanoramaShape shape,
                                                      const ElevationBand& elevations,
                                                      const Tilt& tilt = {});

}  // namespace panonav
