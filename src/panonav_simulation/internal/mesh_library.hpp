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

/// A mesh as read from its file, z up, in metres.
struct FileMesh {
  std::string node;      ///< name of the node that the mesh belongs to
  std::string geometry;  ///< name of the mesh itself
  Material material;
  Mesh mesh;  ///< `object` and `material` are not set
};

/// The mesh files of one scene, each read once.
class MeshLibrary {
 public:
  /// `textures` must outlive this object.
  explicit MeshLibrary(TextureStore& textures) : textures_(textures) {}

  /// Reads a file or returns it from the cache. Throws FileError, the same one on each call. The
  /// reference remains valid.
  const std::vector<FileMesh>& read(const std::filesystem::path& path,
                                    UpAxis up = UpAxis::of_format);

 private:
  using Key = std::pair<std::string, UpAxis>;
  std::vector<FileMesh> import_file(const std::filesystem::path& path, UpAxis up);

  TextureStore& textures_;
  std::map<Key, std::vector<FileMesh>> files_;
  std::map<Key, FileError> errors_;
};

/// Adds `mesh` to the scene, transformed by `world_from_mesh`. Mirroring transforms reverse the
/// order of the corners, so that solids remain solids.
void place_mesh(Scene& scene, const Mesh& mesh, const Affine3& world_from_mesh, std::string object,
                int material);

/// Returns the lowest and highest corner of the meshes from index `first_mesh` on; nullopt if they
/// have no vertex.
[[nodiscard]] std::optional<std::pair<Vector3, Vector3>> extent(const Scene& scene,
                                                                std::size_t first_mesh = 0);

}  // namespace panonav::simulation
