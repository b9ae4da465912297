#pragma once

#include <algorithm>
#include <vector>

#include "panonav/motion/path.hpp"
#include "panonav_simulation/free_space.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::testing {

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

}  // namespace panonav::testing
