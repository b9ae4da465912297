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

/// The mirror camera of the simulated robot, as far as its horizon goes: only the pixels around it
/// that a line is made of are traced, the same rays through the same mirror as for the whole
/// picture, so that a line costs a twentieth of a picture.
struct LineCamera {
  Camera camera;
  Unwarper unwarper;
  SensorOptions sensor;  ///< vignetting and light from one side have no meaning here
  HorizonScanlineOptions line;
  double height_m = 0.6;
  double spread_rad = 0.0;          ///< between neighbouring rays
  std::vector<std::size_t> pixels;  ///< of the image, row by row
  std::vector<MirrorRay> rays;      ///< as many of each pixel
};

/// Makes a camera `height_m` above the floor, `columns` in a line, default noise.
[[nodiscard]] LineCamera make_line_camera(double height_m, int columns = 360);

/// Takes the horizon scanline of the image that the robot takes at `pose`. The same pose and seed
/// give the same bits. May be called from several threads. Cost: some milliseconds.
[[nodiscard]] std::vector<float> take_line(const Renderer& renderer, const Pose2& pose,
                                           const LineCamera& camera, std::uint64_t seed);

}  // namespace panonav::simulation
