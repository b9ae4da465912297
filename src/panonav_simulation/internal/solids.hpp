#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// The bodies that the surfaces of a scene enclose. Triangles of one object that share corners form
/// one surface. A surface encloses a point if its winding number there is above 0.5 (1 inside of a
/// closed surface whose corners run counter-clockwise seen from outside, 0 outside; between them if
/// a side is missing, as the bottom of a box on the ground often is) [Jacobson, Kavan,
/// Sorkine-Hornung 2013].
class Solids {
 public:
  /// Takes O(vertices) time. `scene` must outlive this object and be valid.
  explicit Solids(const Scene& scene);

  /// Returns the number of bodies around a point. A building whose outer surface encloses the point
  /// does not count if an inner surface with corners in the opposite order encloses it, too. Cost:
  /// O(triangles of the surfaces around the point).
  [[nodiscard]] std::size_t count_around(const Vector3& point) const;

  /// A triangle of the scene: index of its mesh, and index within the mesh.
  using Triangle = std::array<std::uint32_t, 2>;
  /// True if nothing of the scene is beyond the extent of a surface: it may be that of a room.
  [[nodiscard]] bool contains_everything(std::size_t surface) const;
  /// Calls `visit` with each triangle of the scene and the number of its surface.
  template <class Visit>
  void for_each_triangle(const Visit& visit) const {
    for (std::size_t s = 0; s < surfaces_.size(); ++s) {
      for (const Triangle& triangle : surfaces_[s].triangles) visit(triangle, s);
    }
  }

 private:
  struct Box {
    Vector3 low;
    Vector3 high;
    [[nodiscard]] bool contains(const Vector3& point) const;
  };
  struct Surface {
    Box box;
    std::vector<Triangle> triangles;
  };
  [[nodiscard]] double winding_number(const Surface& surface, const Vector3& point) const;

  const Scene& scene_;
  std::vector<Surface> surfaces_;
};

}  // namespace panonav::simulation
