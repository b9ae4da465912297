#include "panonav_simulation/screen.hpp"

namespace panonav::simulation {

void add_screen(Scene& scene, const Pose2& across, double width_m, double height_m) {
  const auto material = static_cast<int>(scene.materials.size());
  scene.materials.push_back({.colour = {0.8F, 0.3F, 0.2F}});
  const Point2 left = across * Point2{0.0, 0.5 * width_m};
  const Point2 right = across * Point2{0.0, -0.5 * width_m};
  scene.meshes.push_back({.object = "screen",
                          .material = material,
                          .vertices = {{left.x_m, left.y_m, 0.0},
                                       {right.x_m, right.y_m, 0.0},
                                       {right.x_m, right.y_m, height_m},
                                       {left.x_m, left.y_m, height_m}},
                          .texture_coordinates = {},
                          .triangles = {{0, 1, 2}, {0, 2, 3}}});
}

}  // namespace panonav::simulation
