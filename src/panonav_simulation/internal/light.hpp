#pragma once

#include <array>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav_simulation/internal/ray_tracer.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// A scene's triangles cut so small that light can be interpolated within each.
struct LitTriangles {
  struct Triangle {
    std::array<float, 3> normal{};
    float texture_density = 0.0F;  ///< texture coordinates per metre
    std::array<std::array<float, 2>, 3> uv{};
    std::array<std::array<float, 3>, 2>
        light{};  ///< at the corners, on the normal's side and behind
    int material = 0;
    int mesh = 0;
  };
  std::vector<RayTracer::Vertex> vertices;
  std::vector<RayTracer::Triangle> indices;
  std::vector<Triangle> triangles;  ///< same order as `indices`; light still 0
};

/// Cuts every triangle of a material that light falls upon until no side is longer than
/// `spacing_m`, or an eighth of the distance from the floor where that is more. Triangles without
/// area are left out.
[[nodiscard]] LitTriangles subdivide(const Scene& scene, double spacing_m);

/// Fills in the light at every corner: lamps and far lights by Lambert's law, with `shadows` only
/// where a ray reaches them; the ambient light, with `shadows` dimmed in corners and beneath things
/// by the share of directions that are blocked nearer than five times `spacing_m`. Cost: about 25
/// rays per distinct corner and side with shadows. The same bits on any number of threads.
void bake_light(const Scene& scene, const RayTracer& tracer, bool shadows, double spacing_m,
                LitTriangles& lit, Executor& executor);

}  // namespace panonav::simulation
