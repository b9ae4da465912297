#pragma once

#include <array>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav_simulation/internal/ray_tracer.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A scene's triangles, subdivided so finely that light can be interpolated within each.
struct LitTriangles {
  struct Triangle {
    std::array<float, 3> normal{};
    float texture_density = 0.0F;  ///< texture coordinates per metre
    std::array<std::array<float, 2>, 3> uv{};
    std::array<std::array<float, 3>, 2> light{};  ///< per corner, on the normal's side and behind
    int material = 0;
    int mesh = 0;
  };
  std::vector<RayTracer::Vertex> vertices;
  std::vector<RayTracer::Triangle> indices;
  std::vector<Triangle> triangles;  ///< in the order of `indices`; light is 0 before `bake_light`
};

/// Returns the spacing at which light is computed for a scene: a 25th of the diagonal of its floor,
/// 3 cm to 1 m, or more in a large scene.
[[nodiscard]] double light_spacing_m(const Scene& scene);

/// Subdivides every triangle whose material is lit until no side is longer than `spacing_m` or, if
/// that is larger, an eighth of the distance from the floor. Omits triangles without area.
[[nodiscard]] LitTriangles subdivide(const Scene& scene, double spacing_m);

/// Computes the light at every corner: lamps and distant lights by Lambert's law, with `shadows`
/// only if a ray reaches them; ambient light, with `shadows` reduced by the share of directions
/// that are blocked nearer than five times `spacing_m`, as in corners. Cost: about 25 rays per
/// distinct corner and side with shadows. The same bits on any number of threads.
void bake_light(const Scene& scene, const RayTracer& tracer, bool shadows, double spacing_m,
                LitTriangles& lit, Executor& executor);

}  // namespace panonav::simulation
