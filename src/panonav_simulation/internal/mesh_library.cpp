#include "panonav_simulation/internal/mesh_library.hpp"

#include <algorithm>
#include <utility>

namespace panonav::simulation {

void place_mesh(Scene& scene, const Mesh& mesh, const Affine3& world_from_mesh, std::string object,
                int material) {
  Mesh placed = mesh;
  placed.object = std::move(object);
  placed.material = material;
  for (Vector3& vertex : placed.vertices) vertex = world_from_mesh * vertex;
  if (determinant(world_from_mesh) < 0.0) {
    for (auto& triangle : placed.triangles) std::swap(triangle[0], triangle[1]);
  }
  scene.meshes.push_back(std::move(placed));
}

std::optional<std::pair<Vector3, Vector3>> extent(const Scene& scene, std::size_t first_mesh) {
  std::optional<std::pair<Vector3, Vector3>> result;
  for (std::size_t i = first_mesh; i < scene.meshes.size(); ++i) {
    for (const Vector3& v : scene.meshes[i].vertices) {
      if (!result) result.emplace(v, v);
      auto& [low, high] = *result;
      low = {std::min(low.x_m, v.x_m), std::min(low.y_m, v.y_m), std::min(low.z_m, v.z_m)};
      high = {std::max(high.x_m, v.x_m), std::max(high.y_m, v.y_m), std::max(high.z_m, v.z_m)};
    }
  }
  return result;
}

}  // namespace panonav::simulation
