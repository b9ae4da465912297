#pragma once

#include <filesystem>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/texture_store.hpp"

namespace panonav::simulation {

/// Which axis of a mesh file points up.
enum class UpAxis {
  of_format,  ///< as the file says (COLLADA), y for glTF; z for all formats that do not say it
  y,          ///< whatever the file says
  z,          ///< whatever the file says
};

/// Options of reading a mesh file.
struct MeshOptions {
  TextureOptions textures{};      ///< how pictures on surfaces are read
  UpAxis up = UpAxis::of_format;  ///< which axis becomes the scene's z
  double scale =
      1.0;  ///< metres for one unit of the file, after the unit that COLLADA files state; > 0
};

/// Reads a scene from one mesh file of any format that assimp reads (COLLADA, OBJ, STL, glTF, ...):
/// all its meshes with colours and textures, one object per node. Files carry no useful lights, so
/// one lamp hangs below the top of the scene and `ambient` does the rest. `floor_low .. floor_high`
/// is the extent of the meshes. Missing textures are warnings in the scene. Throws FileError on a
/// file that is missing, damaged or without triangles; ContractError on options out of range.
[[nodiscard]] Scene load_mesh(const std::filesystem::path& path, const MeshOptions& options = {});

}  // namespace panonav::simulation
