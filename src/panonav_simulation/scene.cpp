#include "panonav_simulation/scene.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav::simulation {

namespace {

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
    if (!is_in_reach(vertex)) {
      throw ContractError(name("vertex"), "not finite or too far", "coordinates of -1e9 .. 1e9 m");
    }
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

bool is_in_reach(const Vector3& point) noexcept {
  const auto within = [](double value) { return std::abs(value) <= scene_reach_m; };
  return within(point.x_m) && within(point.y_m) && within(point.z_m);
}

double distance_to_area_m(const FloorArea& area, Point2 point) {
  const double dx_m = std::max({area.low.x_m - point.x_m, 0.0, point.x_m - area.high.x_m});
  const double dy_m = std::max({area.low.y_m - point.y_m, 0.0, point.y_m - area.high.y_m});
  return std::hypot(dx_m, dy_m);
}

void validate(const Scene& scene) {
  for (const Mesh& mesh : scene.meshes) validate_mesh(scene, mesh);
  for (const PointLight& light : scene.lights) {
    if (!is_in_reach(light.position)) {
      throw ContractError("light position", "not finite or too far", "-1e9 .. 1e9 m");
    }
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

void raise_scene(Scene& scene, double height_m) {
  for (Mesh& mesh : scene.meshes) {
    for (Vector3& vertex : mesh.vertices) vertex.z_m += height_m;
  }
  for (PointLight& light : scene.lights) light.position.z_m += height_m;
  if (scene.ground == nullptr) return;
  Ground raised = *scene.ground;
  raised.raise(height_m);
  scene.ground = std::make_shared<const Ground>(std::move(raised));
}

void scale_light(Scene& scene, double factor) {
  const auto f = static_cast<float>(factor);
  scene.ambient *= f;
  for (PointLight& light : scene.lights) light.intensity *= f;
  for (DirectionalLight& light : scene.directional_lights) light.intensity *= f;
  for (float& channel : scene.background) channel *= f;
  for (Material& material : scene.materials) {
    // A surface has the radiance colour * (e + (1 - e) * light). The light is scaled already, so
    // colour and emission e change such that colour' e' = f colour e and colour' (1 - e') = colour
    // (1 - e).
    const float scale = f * material.emission + 1.0F - material.emission;
    for (float& channel : material.colour) channel *= scale;
    material.emission *= f / scale;
  }
}

}  // namespace panonav::simulation
