#include "panonav_simulation/load_mesh.hpp"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/internal/collada_repair.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/regular_files.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

Affine3 to_affine(const aiMatrix4x4& m) {
  return {{m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3}, {m.a4, m.b4, m.c4}};
}

std::string lower_case_extension(const fs::path& path) {
  return to_lower_case(path.extension().string());
}

bool is_gltf(const fs::path& path) {
  const std::string ending = lower_case_extension(path);
  return ending == ".gltf" || ending == ".glb";
}

// Returns the rotation from the importer's axes to z up. With UpAxis::of_format the importer
// converts COLLADA files to y up.
Affine3 rotation_to_z_up(UpAxis up, const fs::path& path) {
  const bool y_up_format = lower_case_extension(path) == ".dae" || is_gltf(path);
  const bool y_up = up == UpAxis::y || (up == UpAxis::of_format && y_up_format);
  if (!y_up) return {};
  return {{1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0}, {}};
}

std::array<float, 3> to_colour(const aiColor3D& c) {
  const auto clamp = [](float value) {
    return std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0.0F;
  };
  return {clamp(c.r), clamp(c.g), clamp(c.b)};
}

Material convert_material(const aiMaterial& source, const fs::path& path, TextureStore& textures) {
  Material material;
  aiColor3D diffuse;
  if (source.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == AI_SUCCESS)
    material.colour = to_colour(diffuse);
  aiString file;
  for (const aiTextureType type : {aiTextureType_DIFFUSE, aiTextureType_BASE_COLOR}) {
    if (material.texture || source.GetTexture(type, 0, &file) != AI_SUCCESS) continue;
    material.texture = textures.find(file.C_Str(), path.parent_path());
  }
  // Show textures unchanged: formats differ in whether the colour tints the texture, and exporters
  // often write black or grey with a texture.
  if (material.texture) material.colour = {1.0F, 1.0F, 1.0F};
  aiColor3D emissive;
  if (!material.texture && source.Get(AI_MATKEY_COLOR_EMISSIVE, emissive) == AI_SUCCESS) {
    const auto emissive_colour = to_colour(emissive);
    const float strength = std::max({emissive_colour[0], emissive_colour[1], emissive_colour[2]});
    const float body = std::max({material.colour[0], material.colour[1], material.colour[2]});
    if (strength > body) {
      material.colour = emissive_colour;
      material.emission = 1.0F;
    }
  }
  return material;
}

// Converts a mesh without the triangles that have a coordinate that is not a finite number.
Mesh convert_mesh(const aiMesh& source, const Affine3& world_from_mesh) {
  Mesh mesh;
  mesh.vertices.reserve(source.mNumVertices);
  const bool is_mirrored = determinant(world_from_mesh) < 0.0;
  std::vector<bool> is_usable;
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& v = source.mVertices[i];
    const Vector3 in_world = world_from_mesh * Vector3{v.x, v.y, v.z};
    is_usable.push_back(is_in_reach(in_world));
    mesh.vertices.push_back(is_usable.back() ? in_world : Vector3{});
  }
  if (source.HasTextureCoords(0)) {
    mesh.texture_coordinates.reserve(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
      const aiVector3D& t = source.mTextureCoords[0][i];
      const bool is_finite = std::isfinite(t.x) && std::isfinite(t.y);
      mesh.texture_coordinates.push_back(is_finite ? std::array{t.x, t.y} : std::array{0.0F, 0.0F});
    }
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices != 3) continue;
    if (!std::all_of(face.mIndices, face.mIndices + 3, [&](unsigned v) { return is_usable[v]; }))
      continue;
    mesh.triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
    if (is_mirrored) std::swap(mesh.triangles.back()[0], mesh.triangles.back()[1]);
  }
  return mesh;
}

struct MeshCollector {
  const aiScene& source;
  std::vector<Material> materials;
  std::vector<FileMesh> meshes;

  void visit(const aiNode& node, const Affine3& world_from_parent) {
    const Affine3 world_from_node = world_from_parent * to_affine(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *source.mMeshes[node.mMeshes[i]];
      FileMesh result{node.mName.C_Str(), mesh.mName.C_Str(), materials.at(mesh.mMaterialIndex),
                      convert_mesh(mesh, world_from_node)};
      if (!result.mesh.triangles.empty()) meshes.push_back(std::move(result));
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) visit(*node.mChildren[i], world_from_node);
  }
};

// Reads a COLLADA file, repaired; as it is if it is no XML.
const aiScene* read_collada(Assimp::Importer& importer, const fs::path& path) {
  try {
    const std::string text = repair_collada(read_scene_file(path));
    return importer.ReadFileFromMemory(text.data(), text.size(), 0, "dae");
  } catch (const FileError&) {
    throw;
  } catch (const Error&) {
    return importer.ReadFile(path.string(), 0);
  }
}

// True if all nodes and faces name only meshes, materials and vertices that exist, on which the
// importer's later steps rely.
bool has_valid_references(const aiScene& scene) {
  const auto is_valid_mesh = [&](const aiMesh* mesh) {
    if (mesh == nullptr || mesh->mVertices == nullptr ||
        mesh->mMaterialIndex >= scene.mNumMaterials)
      return false;
    return std::all_of(mesh->mFaces, mesh->mFaces + mesh->mNumFaces, [&](const aiFace& face) {
      return std::all_of(face.mIndices, face.mIndices + face.mNumIndices,
                         [&](unsigned index) { return index < mesh->mNumVertices; });
    });
  };
  const auto is_valid_node = [&](const auto& self, const aiNode& node) -> bool {
    return std::all_of(node.mMeshes, node.mMeshes + node.mNumMeshes,
                       [&](unsigned index) { return index < scene.mNumMeshes; }) &&
           std::all_of(node.mChildren, node.mChildren + node.mNumChildren,
                       [&](const aiNode* child) { return self(self, *child); });
  };
  return std::all_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes, is_valid_mesh) &&
         is_valid_node(is_valid_node, *scene.mRootNode);
}

// Drops the rotation of the root, by which the importer turns some formats to y up, as Gazebo does.
void remove_root_rotation(aiNode& root) {
  aiVector3D scaling;
  aiQuaternion rotation;
  aiVector3D position;
  root.mTransformation.Decompose(scaling, rotation, position);
  root.mTransformation = aiMatrix4x4(scaling, aiQuaternion(), position);
}

}  // namespace

const std::vector<FileMesh>& MeshLibrary::read(const fs::path& path, UpAxis up) {
  const Key key{path.lexically_normal().string(), up};
  if (const auto known = files_.find(key); known != files_.end()) return known->second;
  if (const auto known = errors_.find(key); known != errors_.end()) throw known->second;
  try {
    return files_.emplace(key, import_file(path, up)).first->second;
  } catch (const FileError& error) {
    errors_.emplace(key, error);
    throw;
  }
}

std::vector<FileMesh> MeshLibrary::import_file(const fs::path& path, UpAxis up) {
  require_scene_file(path);
  Assimp::Importer importer;
  importer.SetIOHandler(make_regular_files());  // the importer takes ownership
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_COLORS | aiComponent_BONEWEIGHTS |
                                  aiComponent_ANIMATIONS | aiComponent_LIGHTS |
                                  aiComponent_CAMERAS);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, up != UpAxis::of_format);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);  // nodes get no dummy mesh
  // The importer's own validation is not used: it rejects files for faults of parts that are
  // removed here (two cameras of one name, animations, bones).
  constexpr unsigned steps = aiProcess_RemoveComponent | aiProcess_Triangulate |
                             aiProcess_SortByPType | aiProcess_JoinIdenticalVertices;
  const bool is_collada = lower_case_extension(path) == ".dae";
  const aiScene* source =
      is_collada ? read_collada(importer, path) : importer.ReadFile(path.string(), 0);
  const std::string fault = importer.GetErrorString();
  if (source == nullptr || source->mRootNode == nullptr)
    throw FileError(path.string(), "not a readable mesh file: " + to_readable_line(fault));
  if (!has_valid_references(*source)) {
    throw FileError(path.string(),
                    "not a readable mesh file: it names a vertex, mesh or material that does not "
                    "exist");
  }
  source = importer.ApplyPostProcessing(steps);
  if (source == nullptr) throw FileError(path.string(), "contains no triangles");
  if (up == UpAxis::z && !is_gltf(path)) remove_root_rotation(*source->mRootNode);
  MeshCollector collector{*source, {}, {}};
  for (unsigned i = 0; i < source->mNumMaterials; ++i) {
    collector.materials.push_back(convert_material(*source->mMaterials[i], path, textures_));
  }
  collector.visit(*source->mRootNode, rotation_to_z_up(up, path));
  if (collector.meshes.empty()) throw FileError(path.string(), "contains no triangles");
  return std::move(collector.meshes);
}

Scene load_mesh(const fs::path& path, const MeshOptions& options) {
  require(options.scale > 0.0 && std::isfinite(options.scale), "scale", options.scale, "> 0");
  TextureStore textures(options.textures);
  MeshLibrary library(textures);
  Scene scene;
  scene.name = path.stem().string();
  const Affine3 scaling = Affine3::scaling(options.scale, options.scale, options.scale);
  for (const FileMesh& part : library.read(path, options.up)) {
    scene.materials.push_back(part.material);
    place_mesh(scene, part.mesh, scaling, part.node.empty() ? part.geometry : part.node,
               static_cast<int>(scene.materials.size()) - 1);
  }
  const auto [low, high] = *extent(scene);
  scene.floor_low = {low.x_m, low.y_m};
  scene.floor_high = {high.x_m, high.y_m};
  // Add a ceiling lamp: in the middle, a tenth of the height below the top, half as bright on the
  // floor below as white.
  const double height = high.z_m - low.z_m;
  const double lamp = low.z_m + 0.9 * height;
  scene.lights.push_back({{0.5 * (low.x_m + high.x_m), 0.5 * (low.y_m + high.y_m), lamp},
                          static_cast<float>(0.5 * (lamp - low.z_m) * (lamp - low.z_m))});
  scene.warnings = textures.warnings();
  return scene;
}

}  // namespace panonav::simulation
