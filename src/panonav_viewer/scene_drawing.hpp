#pragma once

#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// Returns a scene from above, as the background of a plot: objects as they are (their convex
/// bodies, so that screens are slanted and the crowns of trees round), and walls, cut at the height
/// of the camera so that doors are open.
[[nodiscard]] std::vector<MapLayer> scene_layers(const simulation::Scene& scene);

/// Returns the same as lines; outlines of closed things end where they begin.
[[nodiscard]] std::vector<std::vector<Point2>> scene_outlines(const simulation::Scene& scene);

}  // namespace panonav::viewer
