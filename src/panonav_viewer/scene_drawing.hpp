#pragma once

#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// Returns a map of a scene as the background of a plot: objects as the outlines of their convex
/// bodies (slanted screens, round tree crowns), and walls as sections at the height of the
/// camera, so that doors are open.
[[nodiscard]] std::vector<MapLayer> scene_layers(const simulation::Scene& scene);

/// Returns the map of `scene_layers` as lines; closed outlines end at their first point.
[[nodiscard]] std::vector<std::vector<Point2>> scene_outlines(const simulation::Scene& scene);

}  // namespace panonav::viewer
