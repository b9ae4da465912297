#include "panonav/simulation/scene.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

bool finite(const Vector3& v) {
  return std::isfinite(v.x_m) && std::isfinite(v.y_m) && std::isfinite(v.z_m);
}

void validate_mesh(const Scene& scene, const Mesh& mesh) {
  const auto name = [&mesh](const char* what) { return "mesh \"" + mesh.object + "\": " + what; };
  if (mesh.material < 0 || static_cast<std::size_t>(mesh.material) >= scene.materials.size()) {
    throw ContractError(
        name("material"), mesh.material,
        "0 .. number of materials - 1 (" + std::to_string(scene.materials.size()) + " materials)");
  }
  if (!mesh.texture_coordinates.empty()) {
    require(mesh.texture_coordinates.size() == mesh.vertices.size(),
            name("number of texture coordinates"),
            static_cast<double>(mesh.texture_coordinates.size()), "0 or the number of vertices");
  }
  for (const Vector3& vertex : mesh.vertices) {
    if (!finite(vertex)) throw ContractError(name("vertex"), "not finite", "finite coordinates");
  }
  for (const auto& uv : mesh.texture_coordinates) {
    if (!std::isfinite(uv[0]) || !std::isfinite(uv[1])) {
      throw ContractError(name("texture coordinate"), "not finite", "finite coordinates");
    }
  }
  for (const auto& triangle : mesh.triangles) {
    const std::uint32_t largest = *std::max_element(triangle.begin(), triangle.end());
    require(largest < mesh.vertices.size(), name("vertex index"), largest,
            "0 .. number of vertices - 1");
  }
}

}  // namespace

void validate(const Scene& scene) {
  for (const Mesh& mesh : scene.meshes) validate_mesh(scene, mesh);
  for (const PointLight& light : scene.lights) {
    if (!finite(light.position)) throw ContractError("light position", "not finite", "finite");
    require(std::isfinite(light.intensity), "light intensity", light.intensity, "finite");
    require(light.radius_m >= 0.0F && std::isfinite(light.radius_m), "light radius_m",
            light.radius_m, ">= 0");
  }
  for (const DirectionalLight& light : scene.directional_lights) {
    require(std::isfinite(light.intensity), "light intensity", light.intensity, "finite");
    const Direction3& d = light.towards_light;
    require(d.x * d.x + d.y * d.y + d.z * d.z > 0.0, "length of towards_light", 0.0, "> 0");
  }
  require(scene.ambient >= 0.0F && std::isfinite(scene.ambient), "ambient", scene.ambient, ">= 0");
}

}  // namespace panonav
