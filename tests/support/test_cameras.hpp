#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/camera/camera.hpp"

namespace panonav::testing {

/// 640 x 480, the mirror off the middle, so that nothing is symmetric by chance. Looks from -60 to
/// +30 degrees.
inline Camera mirror_camera() {
  Camera camera;
  camera.model = EquiangularModel{radians(-60.0), radians(30.0)};
  camera.image_size = {640, 480};
  camera.centre = {317.3, 243.8};
  camera.rim_radius_px = 230.0;
  camera.inner_radius_px = 45.0;
  camera.direction = ColumnDirection::clockwise;
  camera.forward_angle_rad = 0.7;
  return camera;
}

/// Two lenses of 640 x 320 together, nothing of them alike: each 100 degrees to any side, turned by
/// 90 degrees in the picture and one of them darker.
inline Camera dual_fisheye_camera() {
  Camera camera;
  camera.image_size = {640, 320};
  camera.model = DualFisheyeModel{
      {FisheyeLens{158.7, 161.2, 88.0, 0.004, -0.001, radians(100), 0.02, 0.03, 1.6, 1.0},
       FisheyeLens{482.1, 158.4, 87.0, 0.0, 0.001, radians(99), 3.13, -0.02, -1.55, 0.85}},
      0.0};
  return camera;
}

/// The first `used` of four cameras of 90 degrees around the robot, of 160 x 120 pixels each.
inline Camera rig_camera(int used) {
  std::vector<Camera> cameras;
  for (int i = 0; i < used; ++i) {
    Camera& camera = cameras.emplace_back();
    camera.model = PinholeModel{.focal_length_px = 80.0, .azimuth_rad = i * std::numbers::pi / 2};
    camera.image_size = {160, 120};
    camera.centre = {80.0, 60.0};
  }
  return make_rig(std::move(cameras));
}

/// The image of a world whose grey level (0 .. 1) depends on the direction; black where the mirror
/// ends; times the gain of a lens. Each pixel is the mean of samples x samples points.
inline Image render(const Camera& camera, const std::function<double(double, double)>& world,
                    int samples = 2) {
  Image image(camera.image_size.width, camera.image_size.height);
  const auto* const dual = std::get_if<DualFisheyeModel>(&camera.model);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      double sum = 0.0;
      const int lens = lens_at(camera, {u + 0.5, v + 0.5});
      const double gain = dual ? dual->lenses[static_cast<std::size_t>(lens)].gain : 1.0;
      for (int i = 0; i < samples; ++i) {
        for (int j = 0; j < samples; ++j) {
          const auto direction =
              unproject(camera, {u + (i + 0.5) / samples, v + (j + 0.5) / samples});
          if (direction) sum += world(direction->azimuth_rad(), direction->elevation_rad());
        }
      }
      image.at(u, v) =
          static_cast<std::uint8_t>(std::lround(255.0 * gain * sum / (samples * samples)));
    }
  }
  return image;
}

}  // namespace panonav::testing
