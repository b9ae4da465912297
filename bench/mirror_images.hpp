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

/// A 360 degree camera of two lenses, 190 degrees each, in a 1280 x 640 picture.
inline Camera dual_fisheye_camera() {
  DualFisheyeModel model;
  for (int i = 0; i < 2; ++i) {
    model.lenses[i].centre_u_px = 320.0 + 640.0 * i;
    model.lenses[i].centre_v_px = 320.0;
    model.lenses[i].focal_length_px = 180.0;
    model.lenses[i].azimuth_rad = 3.14 * i;
  }
  Camera camera;
  camera.model = model;
  camera.image_size = {1280, 640};
  return camera;
}

/// Several images, as a camera delivers them, so that none stays in the first-level cache.
inline std::vector<Image> images(ImageSize size = {640, 480}) {
  Random random(1);
  std::vector<Image> result;
  for (int i = 0; i < 8; ++i) {
    Image image(size.width, size.height);
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
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
