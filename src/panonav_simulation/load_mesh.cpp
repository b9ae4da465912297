#include "panonav_simulation/load_mesh.hpp"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <limits>
#include <locale>
#include <map>
#include <optional>
#include <sstream>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/xml.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

Affine3 to_affine(const aiMatrix4x4& m) {
  return {{m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3}, {m.a4, m.b4, m.c4}};
}

std::string lower_case_extension(const fs::path& path) {
  return to_lower_case(path.extension().string());
}

// Returns the rotation from the importer's axes to z up. The importer already converts COLLADA
// files to y up.
Affine3 rotation_to_z_up(UpAxis up, const fs::path& path) {
  const std::string ending = lower_case_extension(path);
  const bool y_up_format = ending == ".dae" || ending == ".gltf" || ending == ".glb";
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

Mesh convert_mesh(const aiMesh& source, const Affine3& world_from_mesh) {
  Mesh mesh;
  mesh.vertices.reserve(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& v = source.mVertices[i];
    mesh.vertices.push_back(world_from_mesh * Vector3{v.x, v.y, v.z});
  }
  if (source.HasTextureCoords(0)) {
    mesh.texture_coordinates.reserve(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
      const aiVector3D& t = source.mTextureCoords[0][i];
      mesh.texture_coordinates.push_back({t.x, t.y});
    }
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices != 3) continue;
    mesh.triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
  }
  return mesh;
}

bool is_finite(const Mesh& mesh) {
  return std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                     [](const Vector3& v) {
                       return std::isfinite(v.x_m) && std::isfinite(v.y_m) && std::isfinite(v.z_m);
                     }) &&
         std::all_of(mesh.texture_coordinates.begin(), mesh.texture_coordinates.end(),
                     [](const auto& t) { return std::isfinite(t[0]) && std::isfinite(t[1]); });
}

struct MeshCollector {
  const aiScene& source;
  const fs::path& path;
  std::vector<Material> materials;
  std::vector<FileMesh> meshes;

  void visit(const aiNode& node, const Affine3& world_from_parent) {
    const Affine3 world_from_node = world_from_parent * to_affine(node.mTransformation);
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *source.mMeshes[node.mMeshes[i]];
      FileMesh result{node.mName.C_Str(), mesh.mName.C_Str(), materials.at(mesh.mMaterialIndex),
                      convert_mesh(mesh, world_from_node)};
      if (result.mesh.triangles.empty()) continue;
      if (!is_finite(result.mesh)) {
        throw FileError(path.string(), "mesh \"" + result.geometry +
                                           "\" has a coordinate that is not a finite number");
      }
      meshes.push_back(std::move(result));
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) visit(*node.mChildren[i], world_from_node);
  }
};

// Opens the files that a mesh file names (materials, buffers); reports all but regular files as
// missing.
class RegularFiles final : public Assimp::DefaultIOSystem {
 public:
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    try {
      require_scene_file(file);
    } catch (const FileError&) {
      return nullptr;
    }
    return Assimp::DefaultIOSystem::Open(file, mode);
  }
};

// Repairs COLLADA constructs that the importer rejects: polygons with holes, and blanks before the
// numbers of a colour. Each hole is merged into the outline by a cut between the nearest pair of
// vertices.
class ColladaRepair {
 public:
  explicit ColladaRepair(pugi::xml_node root) {
    collect(root);
    for (const pugi::xml_node& polygons : polygons_) merge_holes(polygons);
  }

 private:
  using Corner = std::vector<double>;  // indices of one vertex, one per input
  using Outline = std::vector<Corner>;

  void collect(pugi::xml_node element) {
    if (const pugi::xml_attribute id = element.attribute("id"))
      by_id_.emplace("#" + std::string(id.value()), element);
    if (has_name(element, "polygons")) polygons_.push_back(element);
    const bool has_children =
        element.find_child([](pugi::xml_node child) { return child.type() == pugi::node_element; });
    if (!has_children) return set_text(element, element_text(element));
    for (const pugi::xml_node& child : element) {
      if (child.type() == pugi::node_element) collect(child);
    }
  }

  static bool has_name(pugi::xml_node element, std::string_view name) {
    return element.name() == name;
  }

  static void set_text(pugi::xml_node element, const std::string& text) {
    element.remove_children();
    if (!text.empty()) element.text().set(text.c_str());
  }

  [[nodiscard]] pugi::xml_node find_input_source(pugi::xml_node element,
                                                 std::string_view semantic) const {
    for (const pugi::xml_node& input : element.children("input")) {
      if (input.attribute("semantic").value() != semantic) continue;
      const auto found = by_id_.find(input.attribute("source").value());
      return found == by_id_.end() ? pugi::xml_node() : found->second;
    }
    return {};
  }

  void merge_holes(pugi::xml_node polygons) {
    const pugi::xml_node array =
        find_input_source(find_input_source(polygons, "VERTEX"), "POSITION").child("float_array");
    positions_ = array ? parse_numbers(element_text(array)) : std::nullopt;
    inputs_ = 1;
    vertex_input_ = 0;
    for (const pugi::xml_node& input : polygons.children("input")) {
      const auto offset = parse_numbers(input.attribute("offset").value());
      if (!offset || offset->size() != 1) continue;
      if (!(offset->front() >= 0.0 && offset->front() < 32.0)) return;
      const auto number = static_cast<std::size_t>(offset->front());
      inputs_ = std::max(inputs_, number + 1);
      if (std::string_view(input.attribute("semantic").value()) == "VERTEX") vertex_input_ = number;
    }
    for (pugi::xml_node polygon : polygons.children()) {
      if (has_name(polygon, "ph")) merge_holes_of_polygon(polygon);
    }
  }

  // Replaces a polygon with holes by an equivalent one without holes.
  void merge_holes_of_polygon(pugi::xml_node polygon) const {
    Outline outline;
    for (const pugi::xml_node& ring : polygon.children("p")) outline = parse_outline(ring);
    for (const pugi::xml_node& ring : polygon.children("h"))
      merge_hole(outline, parse_outline(ring));
    std::string text;
    for (const Corner& corner : outline) {
      for (const double index : corner) text += std::to_string(std::lround(index)) + " ";
    }
    polygon.set_name("p");
    polygon.remove_attributes();
    set_text(polygon, text);
  }

  [[nodiscard]] Outline parse_outline(pugi::xml_node ring) const {
    const auto indices = parse_numbers(element_text(ring)).value_or(std::vector<double>{});
    Outline outline;
    for (std::size_t i = 0; i + inputs_ <= indices.size(); i += inputs_)
      outline.emplace_back(&indices[i], &indices[i] + inputs_);
    return outline;
  }

  [[nodiscard]] Vector3 position(const Corner& corner) const {
    const double index = corner[vertex_input_];
    if (!positions_ || !(index >= 0.0 && index < static_cast<double>(positions_->size() / 3)))
      throw Error("a vertex that does not exist");
    const double* p = &(*positions_)[3 * static_cast<std::size_t>(index)];
    return {p[0], p[1], p[2]};
  }

  // Returns the normal of an outline, with twice its area as length.
  [[nodiscard]] Vector3 area_normal(const Outline& outline) const {
    Vector3 sum{};
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vector3 a = position(outline[i]);
      const Vector3 b = position(outline[(i + 1) % outline.size()]);
      sum.x_m += a.y_m * b.z_m - a.z_m * b.y_m;
      sum.y_m += a.z_m * b.x_m - a.x_m * b.z_m;
      sum.z_m += a.x_m * b.y_m - a.y_m * b.x_m;
    }
    return sum;
  }

  void merge_hole(Outline& outline, Outline hole) const {
    if (outline.empty() || hole.empty()) return;
    const Vector3 a = area_normal(outline);
    const Vector3 b = area_normal(hole);
    if (a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m > 0.0) std::reverse(hole.begin(), hole.end());
    constexpr std::size_t max_pairs = 10000000;
    if (outline.size() > max_pairs / hole.size()) throw Error("too many vertices around a hole");
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t at_outline = 0;
    std::size_t at_hole = 0;
    for (std::size_t h = 0; h < hole.size(); ++h) {
      const Vector3 q = position(hole[h]);
      for (std::size_t o = 0; o < outline.size(); ++o) {
        const Vector3 p = position(outline[o]);
        const double distance = std::hypot(p.x_m - q.x_m, p.y_m - q.y_m, p.z_m - q.z_m);
        if (!(distance < nearest)) continue;
        nearest = distance;
        at_outline = o;
        at_hole = h;
      }
    }
    std::rotate(hole.begin(), hole.begin() + static_cast<std::ptrdiff_t>(at_hole), hole.end());
    hole.push_back(hole.front());
    hole.push_back(outline[at_outline]);
    outline.insert(outline.begin() + static_cast<std::ptrdiff_t>(at_outline) + 1, hole.begin(),
                   hole.end());
  }

  std::map<std::string, pugi::xml_node> by_id_;
  std::vector<pugi::xml_node> polygons_;
  std::optional<std::vector<double>> positions_;
  std::size_t inputs_ = 1;
  std::size_t vertex_input_ = 0;
};

std::optional<std::string> repair_collada(const fs::path& path) {
  try {
    const pugi::xml_document document = parse_xml(read_scene_file(path));
    const ColladaRepair repair(document.document_element());
    std::ostringstream text;
    text.imbue(std::locale::classic());
    document.save(text, "", pugi::format_raw | pugi::format_no_declaration);
    return std::move(text).str();
  } catch (const Error&) {
    return std::nullopt;
  }
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
  importer.SetIOHandler(new RegularFiles);  // the importer takes ownership
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                  aiComponent_COLORS | aiComponent_BONEWEIGHTS |
                                  aiComponent_ANIMATIONS | aiComponent_LIGHTS |
                                  aiComponent_CAMERAS);
  constexpr unsigned steps = aiProcess_RemoveComponent | aiProcess_Triangulate |
                             aiProcess_SortByPType | aiProcess_JoinIdenticalVertices |
                             aiProcess_ValidateDataStructure;
  const aiScene* source = importer.ReadFile(path.string(), steps);
  const std::string fault = importer.GetErrorString();
  if (source == nullptr && lower_case_extension(path) == ".dae") {
    if (const auto text = repair_collada(path))
      source = importer.ReadFileFromMemory(text->data(), text->size(), steps, "dae");
  }
  if (source == nullptr || source->mRootNode == nullptr)
    throw FileError(path.string(), "not a readable mesh file: " + to_readable_line(fault));
  MeshCollector collector{*source, path, {}, {}};
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
