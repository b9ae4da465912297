#include "panonav_simulation/internal/sdf_visuals.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "panonav/io/image_file.hpp"
#include "panonav_simulation/internal/heightmap.hpp"
#include "panonav_simulation/internal/material_script.hpp"
#include "panonav_simulation/internal/shapes.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

// Returns the rotation that turns the z axis to the plane's normal.
Affine3 make_frame_along(const Vector3& normal) {
  const double length = std::hypot(normal.x_m, normal.y_m, normal.z_m);
  if (!(length > 0.0)) return {};
  const Vector3 z{normal.x_m / length, normal.y_m / length, normal.z_m / length};
  const double flat = std::hypot(z.x_m, z.z_m);
  const Vector3 x =
      flat > 1e-9 ? Vector3{z.z_m / flat, 0.0, -z.x_m / flat} : Vector3{1.0, 0.0, 0.0};
  const Vector3 y{z.y_m * x.z_m - z.z_m * x.y_m, z.z_m * x.x_m - z.x_m * x.z_m,
                  z.x_m * x.y_m - z.y_m * x.x_m};
  return {{x.x_m, y.x_m, z.x_m, x.y_m, y.y_m, z.y_m, x.z_m, y.z_m, z.z_m}, {}};
}

// Makes the mesh of an SDF shape around its own origin; `nullopt` for an empty shape. Throws
// Unusable.
std::optional<Mesh> make_shape(pugi::xml_node shape) {
  const std::string_view kind = shape.name();
  if (kind == "box") {
    const auto size = read_positive_size(shape, "size", 3);
    return make_box_mesh({size[0], size[1], size[2]});
  }
  if (kind == "cylinder" || kind == "capsule") {
    const double radius_m = read_positive_size(shape, "radius", 1)[0];
    const double length_m = read_positive_size(shape, "length", 1)[0];
    return kind == "capsule" ? make_capsule_mesh(radius_m, length_m)
                             : make_cylinder_mesh(radius_m, length_m);
  }
  if (kind == "sphere") {
    const double r = read_positive_size(shape, "radius", 1)[0];
    return make_ellipsoid_mesh({r, r, r});
  }
  if (kind == "ellipsoid") {
    const auto r = read_positive_size(shape, "radii", 3);
    return make_ellipsoid_mesh({r[0], r[1], r[2]});
  }
  if (kind == "plane") {
    const auto size = read_size(shape, "size", 2, 1.0);
    return make_rectangle_mesh(size[0], size[1]);
  }
  if (kind == "empty") return std::nullopt;
  throw UnusablePart{"panonav does not show a geometry of the kind " + quote(kind)};
}

// Returns the translation that moves the centre of these parts to the origin.
Affine3 make_centring_map(const std::vector<const FileMesh*>& parts) {
  Scene combined;
  for (const FileMesh* part : parts) combined.meshes.push_back(part->mesh);
  const auto [low, high] = *extent(combined);
  Affine3 shift;
  shift.translation = {-0.5 * (low.x_m + high.x_m), -0.5 * (low.y_m + high.y_m),
                       -0.5 * (low.z_m + high.z_m)};
  return shift;
}

/// Makes a strip along a path: two vertices for each point, beside it by half the width at a right
/// angle to the path. The texture covers the width once and repeats along the path.
Mesh make_strip_mesh(const std::vector<Vector3>& path, double width_m) {
  Mesh mesh;
  double along_m = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Vector3& before = path[i > 0 ? i - 1 : 0];
    const Vector3& after = path[std::min(i + 1, path.size() - 1)];
    const double length_m = std::hypot(after.x_m - before.x_m, after.y_m - before.y_m);
    if (!(length_m > 0.0)) throw UnusablePart{"two of its points are at one place"};
    const double left_x_m = -0.5 * width_m * (after.y_m - before.y_m) / length_m;
    const double left_y_m = 0.5 * width_m * (after.x_m - before.x_m) / length_m;
    along_m += std::hypot(path[i].x_m - before.x_m, path[i].y_m - before.y_m);
    for (const double side : {1.0, -1.0}) {
      mesh.vertices.push_back(
          {path[i].x_m + side * left_x_m, path[i].y_m + side * left_y_m, path[i].z_m});
      mesh.texture_coordinates.push_back(
          {side < 0.0 ? 1.0F : 0.0F, static_cast<float>(along_m / width_m)});
    }
    if (i == 0) continue;
    const auto right = static_cast<std::uint32_t>(2 * i + 1);
    mesh.triangles.push_back({right - 3, right - 2, right});
    mesh.triangles.push_back({right - 3, right, right - 1});
  }
  return mesh;
}

void set_emission(Material& material, const Colour& emissive) {
  if (brightness(emissive) <= brightness(material.colour)) return;
  material.colour = emissive;
  material.emission = 1.0F;
}

}  // namespace

void SdfVisuals::add(pugi::xml_node visual, const Affine3& world_from_visual,
                     const SdfOrigin& origin) {
  if (read_number(visual, "transparency", 0.0) > 0.5) return;
  for (const pugi::xml_node& shape : visual.child("geometry")) {
    if (shape.type() == pugi::node_element) add_shape(shape, visual, world_from_visual, origin);
  }
}

void SdfVisuals::add_road(pugi::xml_node road, const Affine3& world_from_road,
                          const SdfOrigin& origin) {
  const double width_m = read_number(road, "width", 1.0);
  if (!(width_m > 0.0)) throw UnusablePart{"its width is not above 0"};
  std::vector<Vector3> path;
  for (const pugi::xml_node& point : road.children("point"))
    path.push_back(read_pose(point).translation);
  if (path.size() < 2) throw UnusablePart{"it has fewer than two points"};
  Scene& scene = context_.scene;
  scene.materials.push_back(apply_material({}, road, origin));
  place_mesh(scene, make_strip_mesh(path, width_m), world_from_road, origin.object,
             static_cast<int>(scene.materials.size()) - 1);
}

void SdfVisuals::add_shape(pugi::xml_node shape, pugi::xml_node visual,
                           const Affine3& world_from_visual, const SdfOrigin& origin) {
  const std::string_view kind = shape.name();
  if (kind == "heightmap") return add_heightmap(shape, visual, world_from_visual, origin);
  if (kind == "mesh") {
    const auto scale = read_size(shape, "scale", 3, 1.0);
    return add_mesh_file(
        shape, visual, world_from_visual * Affine3::scaling(scale[0], scale[1], scale[2]), origin);
  }
  const auto mesh = make_shape(shape);
  if (!mesh) return;
  Affine3 world_from_shape = world_from_visual;
  if (kind == "plane") {
    const auto n = child_text(shape, "normal").empty() ? std::vector{0.0, 0.0, 1.0}
                                                       : read_size(shape, "normal", 3);
    world_from_shape = world_from_visual * make_frame_along({n[0], n[1], n[2]});
  }
  Scene& scene = context_.scene;
  scene.materials.push_back(apply_material({}, visual, origin));
  place_mesh(scene, *mesh, world_from_shape, origin.object,
             static_cast<int>(scene.materials.size()) - 1);
  if (kind == "plane") planes_.push_back(scene.meshes.size() - 1);
}

void SdfVisuals::add_skin(pugi::xml_node skin, const Affine3& world_from_actor,
                          const SdfOrigin& origin) {
  const double scale = read_number(skin, "scale", 1.0);
  add_mesh_file(skin, {}, world_from_actor * Affine3::scaling(scale, scale, scale), origin);
}

// Adds a terrain. Its textures change at the heights of <blend>, without a transition. <sampling>
// is ignored, because it only adds points between those of the image, on nearly the same surface.
void SdfVisuals::add_heightmap(pugi::xml_node shape, pugi::xml_node visual,
                               const Affine3& world_from_visual, const SdfOrigin& origin) {
  const fs::path path = find_file(shape, "heightmap", origin);
  const GreyLevels image = read_grey_levels(path);
  if (image.width < 2 || image.height < 2)
    throw UnusablePart{path.string() + " has fewer than 2 x 2 pixels"};
  if (std::max(image.width, image.height) > max_heightmap_side) {
    context_.warn(origin.object, path.string() + " has " + std::to_string(image.width) + " x " +
                                     std::to_string(image.height) + " pixels; at most " +
                                     std::to_string(max_heightmap_side) + " per side are used");
  }
  const auto size = read_size(shape, "size", 3, 1.0);
  if (!(size[0] > 0.0 && size[1] > 0.0)) throw UnusablePart{"its size in x or y is not above 0"};
  std::vector<double> borders_m;
  std::vector<double> tiles_m;
  std::vector<std::string> textures;
  for (const pugi::xml_node& texture : shape.children("texture")) {
    textures.push_back(child_text(texture, "diffuse"));
    tiles_m.push_back(read_number(texture, "size", 10.0));
    if (!(tiles_m.back() > 0.0)) throw UnusablePart{"the size of a texture is not above 0"};
  }
  if (textures.empty()) {
    textures.emplace_back();
    tiles_m.push_back(1.0);
  }
  for (const pugi::xml_node& blend : shape.children("blend")) {
    if (borders_m.size() + 1 < textures.size())
      borders_m.push_back(read_number(blend, "min_height", 0.0));
  }
  std::ranges::sort(borders_m);
  tiles_m.resize(borders_m.size() + 1);
  Affine3 visual_from_terrain;
  if (const pugi::xml_node pos = shape.child("pos")) {
    const auto p = read_size(shape, "pos", 3, 0.0);
    visual_from_terrain.translation = {p[0], p[1], p[2]};
  }
  const Mesh terrain = make_heightmap_mesh(image, {size[0], size[1], size[2]});
  const std::vector<Mesh> ranges = split_at_heights(terrain, borders_m, tiles_m);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (ranges[i].triangles.empty()) continue;
    Material material = apply_material({}, visual, origin);
    set_texture(material, textures[i], origin);
    context_.scene.materials.push_back(std::move(material));
    place_mesh(context_.scene, ranges[i], world_from_visual * visual_from_terrain, origin.object,
               static_cast<int>(context_.scene.materials.size()) - 1);
  }
}

// Returns the path of the file that a shape names. Throws UnusablePart.
fs::path SdfVisuals::find_file(pugi::xml_node shape, const std::string& what,
                               const SdfOrigin& origin) {
  std::string uri = child_text(shape, "uri");
  if (uri.empty()) uri = child_text(shape, "filename");
  const auto path = context_.find(uri, origin);
  if (!path)
    throw UnusablePart{"its " + what + " " + quote(uri) + " was not found in " +
                       context_.files.list_folders()};
  if (context_.before_mesh) context_.before_mesh(*path);
  return *path;
}

void SdfVisuals::add_mesh_file(pugi::xml_node shape, pugi::xml_node visual,
                               const Affine3& world_from_mesh, const SdfOrigin& origin) {
  const fs::path path = find_file(shape, "mesh", origin);
  const pugi::xml_node submesh = shape.child("submesh");
  const std::string name = child_text(submesh, "name");
  std::vector<const FileMesh*> shown;
  // Gazebo takes the coordinates of all formats as they are, with z up; it ignores <up_axis>.
  for (const FileMesh& part : meshes_.read(path, UpAxis::z)) {
    if (name.empty() || part.node == name || part.geometry == name) shown.push_back(&part);
  }
  if (shown.empty()) throw UnusablePart{path.string() + " has no part " + quote(name)};
  const std::string centre = child_text(submesh, "center");
  const bool is_centred = !name.empty() && (centre == "true" || centre == "1");
  const Affine3 world_from_parts =
      is_centred ? world_from_mesh * make_centring_map(shown) : world_from_mesh;
  for (const FileMesh* part : shown) {
    place_mesh(context_.scene, part->mesh, world_from_parts, origin.object,
               get_or_add_material(*part, visual, origin));
  }
}

// Returns the index of the part's material. Visuals that show the same part share one material,
// unless they change it.
int SdfVisuals::get_or_add_material(const FileMesh& part, pugi::xml_node visual,
                                    const SdfOrigin& origin) {
  const bool is_shared = !visual.child("material");
  if (const auto known = materials_.find(&part); is_shared && known != materials_.end())
    return known->second;
  context_.scene.materials.push_back(apply_material(part.material, visual, origin));
  const int index = static_cast<int>(context_.scene.materials.size()) - 1;
  if (is_shared) materials_.emplace(&part, index);
  return index;
}

// Returns the material of a mesh, changed by the visual's <material>.
Material SdfVisuals::apply_material(Material material, pugi::xml_node visual,
                                    const SdfOrigin& origin) {
  const pugi::xml_node material_element = visual.child("material");
  if (!material_element) return material;
  if (const auto diffuse = read_colour(material_element, "diffuse")) {
    material.colour = *diffuse;
  } else if (const auto ambient = read_colour(material_element, "ambient")) {
    material.colour = *ambient;
  }
  if (const auto emissive = read_colour(material_element, "emissive"))
    set_emission(material, *emissive);
  apply_script(material, material_element, origin);
  for (const pugi::xml_node& workflow : material_element.child("pbr"))
    set_texture(material, child_text(workflow, "albedo_map"), origin);
  return material;
}

void SdfVisuals::set_texture(Material& material, const std::string& written,
                             const SdfOrigin& origin) {
  if (written.empty()) return;
  const auto path = context_.find(written, origin);
  const auto texture =
      context_.textures.find(path ? fs::absolute(*path).string() : written, origin.directory);
  if (!texture) return;
  material.texture = texture;
  material.colour = {1.0F, 1.0F, 1.0F};
}

void SdfVisuals::apply_script(Material& material, pugi::xml_node material_element,
                              const SdfOrigin& origin) {
  const pugi::xml_node script = material_element.child("script");
  std::string name = child_text(script, "name");
  if (name.empty()) name = child_text(material_element, "script");
  if (name.empty()) return;
  std::vector<fs::path> folders;
  for (const pugi::xml_node& uri : (script ? script : material_element).children("uri")) {
    if (const auto found = context_.files.resolve(element_text(uri), origin.directory))
      folders.push_back(found->path);
  }
  // Models list the folders of scripts and textures as separate <uri> elements; the usual scripts
  // folder is searched last.
  folders.push_back(origin.directory / "materials/scripts");
  const auto known = find_script_material(name, folders);
  if (!known) {
    context_.warn(origin.object, "material script " + quote(name) +
                                     " was not found; a plain colour is shown instead");
    return;
  }
  material = Material{};
  if (known->diffuse) material.colour = *known->diffuse;
  if (known->emissive) set_emission(material, *known->emissive);
  set_texture(material, known->texture, {known->texture_directory, origin.object});
}

}  // namespace panonav::simulation
