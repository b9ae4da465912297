#pragma once

#include <cstdint>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/renderer.hpp"

namespace panonav::simulation {

/// Faults of a camera and occluders in front of it. The defaults are those of a
/// small 8-bit camera in a lit room. Light 1 at exposure 1 fills a pixel.
struct SensorOptions {
  double exposure = 1.0;      ///< light collected, times that of a full exposure
  double gain = 1.0;          ///< electronic amplification of signal and noise
  double read_noise = 0.004;  ///< standard deviation of a dark pixel, share of full scale
  double full_well =
      10000.0;              ///< electrons of a full pixel; shot noise is the root of the electrons
  double vignetting = 0.0;  ///< share of light lost at the mirror's rim; grows with radius squared
  /// Light from one side: things in direction `light_azimuth_rad` are brighter by this share, those
  /// opposite darker.
  double directional_light = 0.0;
  double light_azimuth_rad = 0.0;  ///< in the robot frame
  double occluded_fraction = 0.0;  ///< share of all azimuths that people or things stand before
  int occluders = 3;               ///< how many share it, equally wide, spread at random
  bool eight_bit = true;           ///< values are multiples of 1/255; images always are
  friend bool operator==(const SensorOptions&, const SensorOptions&) = default;
};
void visit_options(SensorOptions& options, OptionVisitor& visitor);

/// Returns the panorama of a camera with this sensor, for a rendered one. The same options and seed
/// give the same noise and occluders. `vignetting` has no meaning without a mirror and is left out.
/// Throws OptionError.
[[nodiscard]] Panorama apply_sensor(Panorama view, const SensorOptions& options,
                                    std::uint64_t seed);

/// Returns the image of a camera with this sensor, for one rendered through `camera`. Throws
/// OptionError, and ContractError when the sizes differ.
[[nodiscard]] Image apply_sensor(const Radiance& view, const Camera& camera,
                                 const SensorOptions& options, std::uint64_t seed);

}  // namespace panonav::simulation
