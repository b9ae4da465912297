#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/motion/odometry.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::testing {

/// The simulated mirror camera with a quarter of its pixels along each side.
inline Camera small_mirror_camera() {
  Camera camera = simulation::make_simulated_mirror_camera();
  constexpr double quarter = 0.25;
  camera.image_size = {camera.image_size.width / 4, camera.image_size.height / 4};
  camera.centre = {quarter * camera.centre.u_px, quarter * camera.centre.v_px};
  camera.rim_radius_px *= quarter;
  camera.inner_radius_px *= quarter;
  std::get<HyperboloidalModel>(camera.model).focal_length_px *= quarter;
  return camera;
}

/// A free place at this share (0 .. 1) of the shortest way along the first side of the scene's
/// round trip.
inline simulation::Viewpoint viewpoint_on_tour(const simulation::Scene& scene, double share,
                                               double heading_rad) {
  const simulation::FreeSpace space(scene, simulation::free_space_options(scene));
  const auto path = space.shortest_path(scene.tour.at(0), scene.tour.at(1));
  std::vector<Pose2> way;
  for (const Point2 point : path.value()) way.push_back({point.x_m, point.y_m, 0.0});
  const auto places = simulation::resample(way, std::max(1e-3, share * path_length_m(way)));
  const Pose2& at = places.at(1);
  return {.pose = {at.x_m, at.y_m, heading_rad}, .height_m = scene.camera_height_m};
}

/// Mean and standard deviation of the values of a view.
struct Moments {
  double mean = 0.0;
  double deviation = 0.0;
};
inline Moments moments_of(const Panorama& view) {
  double sum = 0.0;
  double squares = 0.0;
  for (const float value : view.values()) {
    sum += value;
    squares += static_cast<double>(value) * value;
  }
  const auto n = static_cast<double>(view.values().size());
  return {sum / n, std::sqrt(squares / n - sum / n * (sum / n))};
}

/// Returns the mean absolute difference of two views of one shape.
inline double mean_difference(const Panorama& a, const Panorama& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.values().size(); ++i) {
    sum += std::abs(static_cast<double>(a.values()[i]) - b.values()[i]);
  }
  return sum / static_cast<double>(a.values().size());
}

/// Returns the noise of exact odometry.
inline OdometryNoise exact_odometry() {
  return {.translation_from_translation = 0.0,
          .translation_from_rotation = 0.0,
          .rotation_from_translation = 0.0,
          .rotation_from_rotation = 0.0,
          .translation_scale_error = 0.0,
          .rotation_scale_error = 0.0};
}

}  // namespace panonav::testing
