#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"

namespace panonav {

/// The hyperboloidal mirror of the simulation in a 640 x 480 image.
inline Camera mirror_camera() {
  Camera camera;
  camera.model = HyperboloidalModel{9.365, 7.804, 320.0};
  camera.image_size = {640, 480};
  camera.centre = {320.0, 240.0};
  camera.rim_radius_px = 228.0;
  camera.inner_radius_px = 40.0;
  return camera;
}

/// Several images, as a camera delivers them, so that none stays in the first-level cache.
inline std::vector<Image> images() {
  Random random(1);
  std::vector<Image> result;
  for (int i = 0; i < 8; ++i) {
    Image image(640, 480);
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const double value =
            120.0 + 60.0 * std::sin(0.02 * u + i) * std::cos(0.03 * v) + random.normal(0.0, 12.0);
        image.at(u, v) = static_cast<std::uint8_t>(std::fmax(0.0, std::fmin(255.0, value)));
      }
    }
    result.push_back(std::move(image));
  }
  return result;
}

}  // namespace panonav
