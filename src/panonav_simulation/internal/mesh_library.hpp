#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/affine3.hpp"
#include "panonav_simulation/load_mesh.hpp"
#include "panonav_simulation/texture_store.hpp"

namespace panonav::simulation {

/// A mesh as its file holds it, z up, in metres.
struct FileMesh {
  std::string node;      ///< name of the node it hangs on
  std::string geometry;  ///< name of the mesh itself
  Material material;
  Mesh mesh;  ///< `object` and `material` are not set
};

/// Mesh files of one scene, each read once however often it is shown.
class MeshLibrary {
 public:
  /// `textures` outlives *this.
  explicit MeshLibrary(TextureStore& textures) : textures_(textures) {}

  /// Throws FileError, each time the same. The reference stays valid.
  const std::vector<FileMesh>& read(const std::filesystem::path& path,
                                    UpAxis up = UpAxis::of_format);

 private:
  using Key = std::pair<std::string, UpAxis>;
  std::vector<FileMesh> read_new(const std::filesystem::path& path, UpAxis up);

  TextureStore& textures_;
  std::map<Key, std::vector<FileMesh>> files_;
  std::map<Key, FileError> faults_;
};

/// Adds `mesh` to the scene at a place. A map that mirrors keeps the mesh's shape; surfaces are
/// seen from both sides.
void place_mesh(Scene& scene, const Mesh& mesh, const Affine3& world_from_mesh, std::string object,
                int material);

/// Returns the lowest and highest corner of the meshes from `first_mesh` on; nullopt if there is no
/// vertex.
[[nodiscard]] std::optional<std::pair<Vector3, Vector3>> extent(const Scene& scene,
                                                                std::size_t first_mesh = 0);

}  // namespace panonav::simulation
