#pragma once

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Makes a box around the origin. All shapes in this file have z up; the texture covers each face,
/// or a whole round surface, once. `object` and `material` are not set. Sizes must be > 0.
[[nodiscard]] Mesh make_box_mesh(const Vector3& size_m);
/// Makes a cylinder along z, with both ends closed.
[[nodiscard]] Mesh make_cylinder_mesh(double radius_m, double length_m);
/// Makes an ellipsoid with three radii along x, y and z.
[[nodiscard]] Mesh make_ellipsoid_mesh(const Vector3& radii_m);
/// Makes a cylinder of length `length_m` along z with half spheres added at both ends.
[[nodiscard]] Mesh make_capsule_mesh(double radius_m, double length_m);
/// Makes a rectangle in the plane z = 0 whose texture repeats every metre.
[[nodiscard]] Mesh make_rectangle_mesh(double size_x_m, double size_y_m);

}  // namespace panonav::simulation
