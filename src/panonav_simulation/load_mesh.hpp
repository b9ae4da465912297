#pragma once

#include <filesystem>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/texture_store.hpp"

namespace panonav::simulation {

/// The axis of a mesh file that points up.
enum class UpAxis {
  of_format,  ///< by the file (COLLADA), y for glTF, z for other formats
  y,          ///< whatever the file says
  z,          ///< whatever the file says
};

/// Options for reading a mesh file.
struct MeshOptions {
  TextureOptions textures{};      ///< for textures of surfaces
  UpAxis up = UpAxis::of_format;  ///< axis that becomes the scene's z
  double scale = 1.0;             ///< metres per unit, after the unit stated by COLLADA; > 0
};

/// Reads a scene from one mesh file of any format that assimp reads (COLLADA, OBJ, STL, glTF, ...):
/// all its meshes with colours and textures, one object per node. Lights of the file are ignored;
/// instead the scene gets one lamp below its top, and ambient light. `floor_low .. floor_high` is
/// the extent of the meshes. Missing textures are warnings in the scene. Throws FileError on a file
/// that is missing, damaged or without triangles; ContractError on options out of range.
[[nodiscard]] Scene load_mesh(const std::filesystem::path& path, const MeshOptions& options = {});

}  // namespace panonav::simulation
