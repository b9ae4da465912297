#pragma once

#include <cstdint>
#include <span>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/renderer.hpp"

namespace panonav::simulation {

/// Noise and lighting of a camera, and occluders in front of it. The defaults are those of a small
/// 8-bit camera in a lit room. Light 1 at exposure 1 saturates a pixel.
struct SensorOptions {
  double exposure = 1.0;       ///< factor of the light collected
  double gain = 1.0;           ///< electronic amplification of signal and noise
  double read_noise = 0.004;   ///< standard deviation of a dark pixel / full scale
  double full_well = 10000.0;  ///< electrons of a full pixel; fewer mean more shot noise
  double vignetting = 0.0;     ///< share of light lost at the rim; as radius squared
  /// One-sided light: things in direction `light_azimuth_rad` are brighter by this share, things on
  /// the opposite side darker.
  double directional_light = 0.0;
  double light_azimuth_rad = 0.0;  ///< in the robot frame
  double occluded_fraction = 0.0;  ///< share of all azimuths hidden by people or things
  int occluders = 3;               ///< number of these, equally wide, at random azimuths
  bool eight_bit = true;           ///< round panoramas to multiples of 1/255; images always are
  friend bool operator==(const SensorOptions&, const SensorOptions&) = default;
};
void visit_options(SensorOptions& options, OptionVisitor& visitor);

/// Applies the sensor to a rendered panorama. The same options and seed give the same noise and
/// occluders. `vignetting` is ignored, because it needs a mirror. Throws OptionError.
[[nodiscard]] Panorama apply_sensor(Panorama view, const SensorOptions& options,
                                    std::uint64_t seed);

/// Applies the sensor to an image rendered through `camera`. `pixels`: offsets of the pixels that
/// are measured, all others are black; empty: all pixels. Throws OptionError, and ContractError if
/// the sizes differ or a pixel is outside the image.
[[nodiscard]] Image apply_sensor(const Radiance& view, const Camera& camera,
                                 const SensorOptions& options, std::uint64_t seed,
                                 std::span<const std::uint32_t> pixels = {});

}  // namespace panonav::simulation
