#pragma once

#include <map>
#include <vector>

#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/sdf_context.hpp"

namespace panonav::simulation {

/// Adds the visuals of a Gazebo world to its scene: shapes, mesh files and their materials.
class SdfVisuals {
 public:
  /// `context` must outlive this object.
  explicit SdfVisuals(SdfContext& context) : context_(context), meshes_(context.textures) {}

  /// Adds the meshes and materials of a <visual>. Throws UnusablePart, Error.
  void add(pugi::xml_node visual, const Affine3& world_from_visual, const SdfOrigin& origin);

  /// Adds a <road>: a flat strip of its width along its points. Throws UnusablePart, Error.
  void add_road(pugi::xml_node road, const Affine3& world_from_road, const SdfOrigin& origin);

  /// Adds the <skin> of an <actor> as a mesh that does not move. Throws UnusablePart, Error.
  void add_skin(pugi::xml_node skin, const Affine3& world_from_actor, const SdfOrigin& origin);

  /// Returns the indices of the scene's meshes that are planes.
  [[nodiscard]] const std::vector<std::size_t>& planes() const { return planes_; }

 private:
  void add_shape(pugi::xml_node shape, pugi::xml_node visual, const Affine3& world_from_visual,
                 const SdfOrigin& origin);
  void add_heightmap(pugi::xml_node shape, pugi::xml_node visual, const Affine3& world_from_visual,
                     const SdfOrigin& origin);
  std::filesystem::path find_file(pugi::xml_node shape, const std::string& what,
                                  const SdfOrigin& origin);
  void add_mesh_file(pugi::xml_node shape, pugi::xml_node visual, const Affine3& world_from_mesh,
                     const SdfOrigin& origin);
  int get_or_add_material(const FileMesh& part, pugi::xml_node visual, const SdfOrigin& origin);
  Material apply_material(Material material, pugi::xml_node visual, const SdfOrigin& origin);
  void set_texture(Material& material, const std::string& written, const SdfOrigin& origin);
  void apply_script(Material& material, pugi::xml_node material_element, const SdfOrigin& origin);

  SdfContext& context_;
  MeshLibrary meshes_;
  std::map<const FileMesh*, int> materials_;
  std::vector<std::size_t> planes_;
};

}  // namespace panonav::simulation
