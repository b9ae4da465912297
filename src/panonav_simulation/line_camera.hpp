#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/route/horizon_scanline.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::simulation {

/// The mirror camera of the simulated robot, restricted to the horizon: only the pixels that a
/// scanline is computed from are traced, by the same rays as for the whole picture; a line costs a
/// twentieth of a picture.
struct LineCamera {
  Camera camera;
  Unwarper unwarper;
  SensorOptions sensor;  ///< vignetting and one-sided light are ignored
  HorizonScanlineOptions line;
  double height_m = 0.6;
  double spread_rad = 0.0;          ///< between neighbouring rays
  std::vector<std::size_t> pixels;  ///< offsets of the traced pixels in the image
  std::vector<MirrorRay> rays;      ///< the same number for each pixel
};

/// Makes a camera `height_m` above the floor, with `columns` values per line and default noise.
[[nodiscard]] LineCamera make_line_camera(double height_m, int columns = 360);

/// Renders the horizon scanline of the image that the robot would take at `pose`. The same pose and
/// seed give the same bits. May be called from several threads. Cost: some milliseconds.
[[nodiscard]] std::vector<float> capture_line(const Renderer& renderer, const Pose2& pose,
                                              const LineCamera& camera, std::uint64_t seed);

}  // namespace panonav::simulation
