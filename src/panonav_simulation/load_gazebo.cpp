#include "panonav_simulation/load_gazebo.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"
#include "panonav_simulation/internal/material_script.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/shapes.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;
using Colour = std::array<float, 3>;

float brightness(const Colour& c) {
  return 0.299F * c[0] + 0.587F * c[1] + 0.114F * c[2];
}

// The colour that a child of `parent` gives; empty when there is none or it is no colour.
std::optional<Colour> colour_of(const XmlElement& parent, std::string_view name) {
  const auto numbers = numbers_of(parent.value(name));
  if (!numbers || numbers->size() < 3) return std::nullopt;
  Colour colour{};
  for (std::size_t i = 0; i < 3; ++i)
    colour[i] = std::clamp(static_cast<float>((*numbers)[i]), 0.0F, 1.0F);
  return colour;
}

double number_of(const XmlElement& parent, std::string_view name, double otherwise) {
  const auto numbers = numbers_of(parent.value(name));
  return numbers && numbers->size() == 1 ? numbers->front() : otherwise;
}

// What is wrong with one thing of a world, which is left out for it.
struct Unusable {
  std::string why;
};

// `count` numbers; where the element has none, what SDF takes instead.
std::vector<double> size_of(const XmlElement& shape, std::string_view name, std::size_t count,
                            std::optional<double> otherwise = std::nullopt) {
  const std::string_view text = shape.value(name);
  if (text.empty() && otherwise) return std::vector<double>(count, *otherwise);
  auto numbers = numbers_of(text);
  if (!numbers || numbers->size() != count) {
    throw Unusable{"the " + std::string(name) + " of its " + readable_line(shape.name) +
                   " is not " +
                   (count == 1 ? "a finite number" : std::to_string(count) + " finite numbers")};
  }
  return *std::move(numbers);
}

std::vector<double> positive_size_of(const XmlElement& shape, std::string_view name,
                                     std::size_t count) {
  auto numbers = size_of(shape, name, count);
  if (std::any_of(numbers.begin(), numbers.end(), [](double v) { return !(v > 0.0); })) {
    throw Unusable{"the " + std::string(name) + " of its " + readable_line(shape.name) +
                   " is not above 0"};
  }
  return numbers;
}

const XmlElement* pose_element(const XmlElement& part) {
  const XmlElement* pose = part.child("pose");
  return pose != nullptr ? pose : part.child("origin");
}

// What a <pose> says: x y z, then roll pitch yaw or a quaternion x y z w.
Affine3 written_pose(const XmlElement* pose) {
  if (pose == nullptr) return {};
  const std::string_view text =
      pose->text.empty() ? pose->attribute("pose") : std::string_view(pose->text);
  const bool quaternion = pose->attribute("rotation_format") == "quat_xyzw";
  const std::size_t count = quaternion ? 7 : 6;
  const auto n = numbers_of(text);
  if (n && n->empty()) return {};
  if (!n || n->size() != count)
    throw Unusable{"its pose is not " + std::to_string(count) + " finite numbers"};
  const auto& v = *n;
  std::array<double, 4> q{};  // w x y z
  if (quaternion) {
    q = {v[6], v[3], v[4], v[5]};
  } else {
    const bool in_degrees =
        pose->attribute("degrees") == "true" || pose->attribute("degrees") == "1";
    const double half = in_degrees ? std::numbers::pi / 360.0 : 0.5;
    const double cr = std::cos(v[3] * half);
    const double sr = std::sin(v[3] * half);
    const double cp = std::cos(v[4] * half);
    const double sp = std::sin(v[4] * half);
    const double cy = std::cos(v[5] * half);
    const double sy = std::sin(v[5] * half);
    q = {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
         cr * cp * sy - sr * sp * cy};
  }
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(length > 0.0) || !std::isfinite(length)) throw Unusable{"its pose has no rotation"};
  const double w = q[0] / length;
  const double x = q[1] / length;
  const double y = q[2] / length;
  const double z = q[3] / length;
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
           2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
           2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)},
          {v[0], v[1], v[2]}};
}

// Of a rotation and translation.
Affine3 inverse(const Affine3& b_from_a) {
  const auto& m = b_from_a.matrix;
  Affine3 result{{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}, {}};
  const Vector3 back = result * b_from_a.translation;
  result.translation = {-back.x_m, -back.y_m, -back.z_m};
  return result;
}

std::string_view frame_of_pose(const XmlElement& part) {
  const XmlElement* pose = pose_element(part);
  if (pose == nullptr) return {};
  const std::string_view frame = pose->attribute("relative_to");
  return frame.empty() ? pose->attribute("frame") : frame;
}

std::string in_quotes(std::string_view text) {
  return "\"" + readable_line(text) + "\"";
}

// "Ground Plane" and ".../ground_plane" are one: Gazebo's database and its servers differ.
std::string well_known_name(std::string_view uri) {
  std::string name(uri.substr(uri.find_last_of('/') + 1));
  for (auto at = name.find("%20"); at != std::string::npos; at = name.find("%20"))
    name.replace(at, 3, "_");
  std::ranges::replace(name, ' ', '_');
  return lower_case(name);
}

// The two models of Gazebo's database that nearly all worlds take from there.
const XmlElement* well_known_model(std::string_view uri) {
  static const XmlElement sun = parse_xml(
      "<sdf><light name='sun' type='directional'><pose>0 0 10 0 0 0</pose>"
      "<diffuse>0.8 0.8 0.8 1</diffuse><direction>-0.5 0.1 -0.9</direction></light></sdf>");
  static const XmlElement ground = parse_xml(
      "<sdf><model name='ground_plane'><link name='link'><visual name='visual'><geometry><plane>"
      "<normal>0 0 1</normal><size>100 100</size></plane></geometry><material><script>"
      "<name>Gazebo/Grey</name></script></material></visual></link></model></sdf>");
  const std::string name = well_known_name(uri);
  return name == "sun" ? &sun : name == "ground_plane" ? &ground : nullptr;
}

// A frame whose z axis is the plane's normal.
Affine3 turned_to(const Vector3& normal) {
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

// Where an element of a world stands: what must be known to read it.
struct Place {
  const XmlElement* scope = nullptr;  // the model or world whose frames its pose may name
  fs::path directory;                 // of its file
  Affine3 world_from_scope;
  std::string object;  // the model at the top that it belongs to; empty in the world itself
};

class WorldReader {
 public:
  WorldReader(const fs::path& world, const GazeboOptions& options)
      : world_(world),
        textures_(options.textures),
        meshes_(textures_),
        files_(world, options.model_folders) {
    scene_.camera_height_m = options.camera_height_m;
    scene_.ambient = 0.4F;  // SDF's own defaults
    scene_.background = {0.7F, 0.7F, 0.7F};
  }

  Scene read() {
    const XmlElement& root = files_.sdf(world_);
    opened_.push_back(world_.lexically_normal());
    const XmlElement* world = root.child("world");
    const XmlElement& top = world == nullptr ? root : *world;
    scene_.name = std::string(top.attribute("name"));
    if (world == nullptr) {
      const XmlElement* model = root.child("model");
      scene_.name =
          model == nullptr ? world_.stem().string() : std::string(model->attribute("name"));
    }
    if (const XmlElement* look = top.child("scene")) {
      if (const auto ambient = colour_of(*look, "ambient")) scene_.ambient = brightness(*ambient);
      if (const auto background = colour_of(*look, "background")) scene_.background = *background;
    }
    add_parts(top, {&top, world_.parent_path(), {}, {}});
    if (scene_.meshes.empty()) {
      throw FileError(
          world_.string(),
          "shows nothing: no visual with a shape" +
              (warnings_.empty() ? std::string() : "; left out: " + as_line(warnings_.front())));
    }
    set_floor();
    expose();
    for (const Warning& warning : warnings_)
      scene_.warnings.push_back(world_.string() + ": " + as_line(warning));
    return std::move(scene_);
  }

 private:
  struct Warning {
    std::vector<std::string> objects;  // the models that it concerns; none for the world itself
    std::string what;
    int count = 0;
  };

  static std::string as_line(const Warning& warning) {
    constexpr std::size_t max_named = 3;
    const std::size_t models = warning.objects.size();
    std::string line = models == 0 ? "" : models == 1 ? "model " : "models ";
    for (std::size_t i = 0; i < std::min(models, max_named); ++i)
      line += (i == 0 ? "" : ", ") + in_quotes(warning.objects[i]);
    if (models > max_named) line += " and " + std::to_string(models - max_named) + " more";
    line += (models == 0 ? "" : ": ") + warning.what;
    const bool is_repeated = warning.count > static_cast<int>(std::max<std::size_t>(models, 1));
    return is_repeated ? line + " (" + std::to_string(warning.count) + " times)" : line;
  }

  void warn(const std::string& object, const std::string& what) {
    const auto [known, is_new] = warning_of_text_.try_emplace(what, warnings_.size());
    if (is_new) warnings_.push_back({{}, what});
    Warning& warning = warnings_[known->second];
    ++warning.count;
    auto& objects = warning.objects;
    if (!object.empty() && (objects.empty() || objects.back() != object)) objects.push_back(object);
  }

  // A thing that cannot be shown is left out; the rest of the world is read on.
  template <class Add>
  void try_to_add(const std::string& thing, const std::string& object, const Add& add) {
    try {
      add();
    } catch (const Unusable& fault) {
      warn(object, thing + " is left out: " + fault.why);
    } catch (const Error& error) {
      warn(object, thing + " is left out: " + readable_line(error.what()));
    }
    while (texture_warnings_ < textures_.warnings().size())
      warn(object, readable_line(textures_.warnings()[texture_warnings_++]));
  }

  std::optional<fs::path> find(std::string_view uri, const fs::path& directory,
                               const std::string& object) {
    const auto found = files_.resolve(uri, directory);
    if (!found) return std::nullopt;
    if (!found->as_written) {
      warn(object, in_quotes(uri) + " was not found; taken instead, with letters of other case: " +
                       readable_line(found->path.string()));
    }
    return found->path;
  }

  // Where a frame of a model or world stands in it; empty when there is none of this name.
  std::optional<Affine3> scope_from_frame(const XmlElement& scope, std::string_view name,
                                          int depth = 0) const {
    constexpr int max_depth = 32;
    if (name.empty() || name == "__model__" || name == "world") return Affine3{};
    if (depth > max_depth) return std::nullopt;
    const auto split = name.find("::");
    for (const XmlElement& part : scope.children) {
      if (part.attribute("name") != name.substr(0, split)) continue;
      if (part.name != "link" && part.name != "model" && part.name != "frame" &&
          part.name != "joint") {
        continue;
      }
      std::string_view base = frame_of_pose(part);
      if (base.empty() && part.name == "joint") base = part.value("child");
      if (base.empty() && part.name == "frame") base = part.attribute("attached_to");
      const auto scope_from_base = scope_from_frame(scope, base, depth + 1);
      if (!scope_from_base) return std::nullopt;
      const Affine3 scope_from_part = *scope_from_base * written_pose(pose_element(part));
      if (split == std::string_view::npos) return scope_from_part;
      const auto inner = scope_from_frame(part, name.substr(split + 2), depth + 1);
      return inner ? std::optional(scope_from_part * *inner) : std::nullopt;
    }
    return std::nullopt;
  }

  // The pose of a part; `world_from_parent` where it names no frame.
  Affine3 world_from(const XmlElement& part, const Affine3& world_from_parent, const Place& place) {
    const std::string_view frame = frame_of_pose(part);
    const Affine3 written = written_pose(pose_element(part));
    if (frame.empty()) return world_from_parent * written;
    if (const auto scope_from_base = scope_from_frame(*place.scope, frame))
      return place.world_from_scope * *scope_from_base * written;
    warn(place.object, "the pose of " + in_quotes(part.attribute("name")) + " is relative to " +
                           in_quotes(frame) + ", which is not there; taken relative to its parent");
    return world_from_parent * written;
  }

  // Models, lights and what is included, in the order of the file.
  void add_parts(const XmlElement& parent, const Place& place) {
    for (const XmlElement& part : parent.children) add_part(part, part, place);
  }

  // `placed_by`: the part itself, or the <include> whose name and pose replace its own.
  void add_part(const XmlElement& part, const XmlElement& placed_by, const Place& place) {
    const std::string name(placed_by.value("name").empty() ? part.attribute("name")
                                                           : placed_by.value("name"));
    const std::string thing = part.name + " " + in_quotes(name);
    if (part.name == "include") {
      try_to_add(part.name + " " + in_quotes(part.value("uri")), place.object,
                 [&] { add_include(part, place); });
    } else if (part.name == "model") {
      try_to_add(thing, place.object, [&] { add_model(part, placed_by, name, place); });
    } else if (part.name == "light") {
      try_to_add(thing, place.object, [&] {
        const XmlElement& posed = pose_element(placed_by) != nullptr ? placed_by : part;
        add_light(part, world_from(posed, place.world_from_scope, place));
      });
    } else if (part.name == "actor" || part.name == "population" || part.name == "road") {
      warn(place.object, thing + " is left out: panonav shows nothing of this kind");
    }
  }

  void add_include(const XmlElement& include, const Place& place) {
    constexpr std::size_t max_depth = 32;
    constexpr int max_includes = 100000;
    const std::string_view uri = include.value("uri");
    fs::path file;
    const XmlElement* root = nullptr;
    if (const auto found = find(uri, place.directory, place.object)) {
      std::error_code code;
      file = fs::is_directory(*found, code) ? GazeboFiles::description_in(*found) : *found;
      file = file.lexically_normal();
      if (std::find(opened_.begin(), opened_.end(), file) != opened_.end())
        throw Unusable{"it includes itself, directly or through other models"};
      if (opened_.size() >= max_depth) throw Unusable{"it is included more than 32 models deep"};
      if (++includes_ > max_includes)
        throw Unusable{"the world includes more than 100000 models in all"};
      root = &files_.sdf(file);
    } else if (root = well_known_model(uri); root == nullptr) {
      throw Unusable{"it was not found in " + files_.places()};
    }
    Place inside = place;
    if (!file.empty()) inside.directory = file.parent_path();
    opened_.push_back(file);
    bool any = false;
    for (const XmlElement& part : root->children) {
      if (part.name != "model" && part.name != "light" && part.name != "actor") continue;
      any = true;
      add_part(part, include, inside);
      break;  // Gazebo takes the first as well
    }
    opened_.pop_back();
    if (!any) throw Unusable{"its file holds neither a model nor a light"};
  }

  void add_model(const XmlElement& model, const XmlElement& placed_by, const std::string& name,
                 const Place& place) {
    const XmlElement& posed = pose_element(placed_by) != nullptr ? placed_by : model;
    Place inside = place;
    inside.scope = &model;
    if (inside.object.empty()) inside.object = name;
    inside.world_from_scope = world_from(posed, place.world_from_scope, place);
    std::string_view anchor = placed_by.value("placement_frame");
    if (anchor.empty()) anchor = model.attribute("placement_frame");
    if (const auto model_from_anchor = scope_from_frame(model, anchor))
      inside.world_from_scope = inside.world_from_scope * inverse(*model_from_anchor);
    for (const XmlElement& link : model.children) {
      if (link.name != "link") continue;
      try_to_add("link " + in_quotes(link.attribute("name")), inside.object,
                 [&] { add_link(link, inside); });
    }
    add_parts(model, inside);
  }

  void add_link(const XmlElement& link, const Place& place) {
    const Affine3 world_from_link = world_from(link, place.world_from_scope, place);
    for (const XmlElement& part : link.children) {
      if (part.name != "visual" && part.name != "light") continue;
      const std::size_t meshes_before = scene_.meshes.size();
      const std::string thing = part.name + " " + in_quotes(part.attribute("name"));
      try_to_add(thing, place.object, [&] {
        const Affine3 world_from_part = world_from(part, world_from_link, place);
        if (part.name == "light") return add_light(part, world_from_part);
        add_visual(part, world_from_part, place);
        for (std::size_t i = meshes_before; i < scene_.meshes.size(); ++i) {
          const auto& vertices = scene_.meshes[i].vertices;
          if (std::all_of(vertices.begin(), vertices.end(), can_be_shown)) continue;
          scene_.meshes.resize(meshes_before);
          throw Unusable{"it reaches farther than 1000 km"};
        }
      });
    }
  }

  static bool can_be_shown(const Vector3& v) {
    constexpr double reach_m = 1e6;
    return std::abs(v.x_m) <= reach_m && std::abs(v.y_m) <= reach_m && std::abs(v.z_m) <= reach_m;
  }

  void add_light(const XmlElement& light, const Affine3& world_from_light) {
    const float strength =
        brightness(colour_of(light, "diffuse").value_or(Colour{1.0F, 1.0F, 1.0F})) *
        static_cast<float>(number_of(light, "intensity", 1.0));
    if (light.attribute("type") == "directional") {
      const auto d = light.value("direction").empty() ? std::vector{0.0, 0.0, -1.0}
                                                      : size_of(light, "direction", 3);
      Affine3 turn = world_from_light;
      turn.translation = {};
      const Vector3 away = turn * Vector3{d[0], d[1], d[2]};
      if (away == Vector3{}) return;
      scene_.directional_lights.push_back({{-away.x_m, -away.y_m, -away.z_m}, strength});
      return;
    }
    const XmlElement* attenuation = light.child("attenuation");
    const auto factor = [&](const char* name, double otherwise) {
      return std::max(
          0.0, attenuation == nullptr ? otherwise : number_of(*attenuation, name, otherwise));
    };
    // Gazebo's 1 / (c + l d + q d^2) is our intensity / (d^2 + radius^2) but for the linear term,
    // which is taken into the quadratic one so that both agree at 2 m, about the way from a lamp to
    // furniture. A lamp that does not fade is one of 100 m radius.
    const double c = factor("constant", 1.0);
    const double q = factor("quadratic", 0.0) + 0.5 * factor("linear", 1.0);
    const double fade = std::max(q, 1e-4 * c);
    if (!(fade > 0.0)) throw Unusable{"it has no attenuation that is larger than 0"};
    scene_.lights.push_back({world_from_light.translation, static_cast<float>(strength / fade),
                             static_cast<float>(std::sqrt(c / fade))});
  }

  void add_visual(const XmlElement& visual, const Affine3& world_from_visual, const Place& place) {
    const XmlElement* geometry = visual.child("geometry");
    if (geometry == nullptr || number_of(visual, "transparency", 0.0) > 0.5) return;
    const auto add = [&](const Mesh& mesh, const Affine3& world_from_shape) {
      scene_.materials.push_back(dressed({}, visual, place));
      place_mesh(scene_, mesh, world_from_shape, place.object,
                 static_cast<int>(scene_.materials.size()) - 1);
    };
    for (const XmlElement& shape : geometry->children) {
      if (shape.name == "mesh") {
        add_mesh_file(shape, visual, world_from_visual, place);
      } else if (shape.name == "box") {
        const auto size = positive_size_of(shape, "size", 3);
        add(box_mesh({size[0], size[1], size[2]}), world_from_visual);
      } else if (shape.name == "cylinder") {
        add(cylinder_mesh(positive_size_of(shape, "radius", 1)[0],
                          positive_size_of(shape, "length", 1)[0]),
            world_from_visual);
      } else if (shape.name == "sphere") {
        const double r = positive_size_of(shape, "radius", 1)[0];
        add(ellipsoid_mesh({r, r, r}), world_from_visual);
      } else if (shape.name == "ellipsoid") {
        const auto r = positive_size_of(shape, "radii", 3);
        add(ellipsoid_mesh({r[0], r[1], r[2]}), world_from_visual);
      } else if (shape.name == "capsule") {
        add(capsule_mesh(positive_size_of(shape, "radius", 1)[0],
                         positive_size_of(shape, "length", 1)[0]),
            world_from_visual);
      } else if (shape.name == "plane") {
        const auto size = size_of(shape, "size", 2, 1.0);
        const auto n = shape.value("normal").empty() ? std::vector{0.0, 0.0, 1.0}
                                                     : size_of(shape, "normal", 3);
        add(rectangle_mesh(size[0], size[1]), world_from_visual * turned_to({n[0], n[1], n[2]}));
        planes_.push_back(scene_.meshes.size() - 1);
      } else if (shape.name != "empty") {
        throw Unusable{"panonav does not show a geometry of the kind " + in_quotes(shape.name)};
      }
    }
  }

  void add_mesh_file(const XmlElement& shape, const XmlElement& visual,
                     const Affine3& world_from_visual, const Place& place) {
    const std::string_view uri =
        shape.value("uri").empty() ? shape.value("filename") : shape.value("uri");
    const auto path = find(uri, place.directory, place.object);
    if (!path)
      throw Unusable{"its mesh " + in_quotes(uri) + " was not found in " + files_.places()};
    const std::vector<FileMesh>& parts = meshes_.read(*path);
    const XmlElement* submesh = shape.child("submesh");
    const std::string_view wanted_name =
        submesh == nullptr ? std::string_view{} : submesh->value("name");
    std::vector<const FileMesh*> wanted;
    for (const FileMesh& part : parts) {
      if (wanted_name.empty() || part.node == wanted_name || part.geometry == wanted_name)
        wanted.push_back(&part);
    }
    if (wanted.empty()) throw Unusable{path->string() + " has no part " + in_quotes(wanted_name)};
    const auto scale = size_of(shape, "scale", 3, 1.0);
    Affine3 world_from_mesh = world_from_visual * Affine3::scaling(scale[0], scale[1], scale[2]);
    if (!wanted_name.empty()) {
      const std::string_view centre = submesh->value("center");
      if (centre == "true" || centre == "1") world_from_mesh = world_from_mesh * centring(wanted);
    }
    for (const FileMesh* part : wanted) {
      place_mesh(scene_, part->mesh, world_from_mesh, place.object,
                 material_index(*part, visual, place));
    }
  }

  static Affine3 centring(const std::vector<const FileMesh*>& parts) {
    Scene together;
    for (const FileMesh* part : parts) together.meshes.push_back(part->mesh);
    const auto [low, high] = *extent(together);
    Affine3 shift;
    shift.translation = {-0.5 * (low.x_m + high.x_m), -0.5 * (low.y_m + high.y_m),
                         -0.5 * (low.z_m + high.z_m)};
    return shift;
  }

  // Models that stand there many times share their materials, unless the visual changes them.
  int material_index(const FileMesh& part, const XmlElement& visual, const Place& place) {
    if (visual.child("material") == nullptr) {
      const auto known = materials_.find(&part);
      if (known != materials_.end()) return known->second;
    }
    scene_.materials.push_back(dressed(part.material, visual, place));
    const int index = static_cast<int>(scene_.materials.size()) - 1;
    if (visual.child("material") == nullptr) materials_.emplace(&part, index);
    return index;
  }

  // The material of a mesh with what the visual's <material> says on top.
  Material dressed(Material material, const XmlElement& visual, const Place& place) {
    const XmlElement* said = visual.child("material");
    if (said == nullptr) return material;
    if (const auto diffuse = colour_of(*said, "diffuse")) {
      material.colour = *diffuse;
    } else if (const auto ambient = colour_of(*said, "ambient")) {
      material.colour = *ambient;
    }
    if (const auto emissive = colour_of(*said, "emissive")) shine(material, *emissive);
    apply_script(material, *said, place);
    if (const XmlElement* pbr = said->child("pbr")) {
      for (const XmlElement& workflow : pbr->children)
        set_texture(material, workflow.value("albedo_map"), place.directory, place.object);
    }
    return material;
  }

  static void shine(Material& material, const Colour& emissive) {
    if (brightness(emissive) <= brightness(material.colour)) return;
    material.colour = emissive;
    material.emission = 1.0F;
  }

  void set_texture(Material& material, std::string_view written, const fs::path& directory,
                   const std::string& object) {
    if (written.empty()) return;
    const auto path = find(written, directory, object);
    const auto texture = path ? textures_.find(fs::absolute(*path).string(), directory)
                              : textures_.find(written, directory);
    if (!texture) return;
    material.texture = texture;
    material.colour = {1.0F, 1.0F, 1.0F};
  }

  void apply_script(Material& material, const XmlElement& said, const Place& place) {
    const XmlElement* script = said.child("script");
    std::string_view name = said.value("script");
    if (script != nullptr && !script->value("name").empty()) name = script->value("name");
    if (name.empty()) return;
    std::vector<fs::path> places;
    for (const XmlElement& part : script == nullptr ? said.children : script->children) {
      if (part.name != "uri") continue;
      if (const auto found = files_.resolve(part.text, place.directory))
        places.push_back(found->path);
    }
    // Models list the folders of their scripts and textures as several <uri>; they lie side by
    // side.
    places.push_back(place.directory / "materials/scripts");
    const auto known = find_script_material(name, places);
    if (!known) {
      warn(place.object, "material script " + in_quotes(name) +
                             " was not found; a plain colour is shown instead");
      return;
    }
    material = Material{};
    if (known->diffuse) material.colour = *known->diffuse;
    if (known->emissive) shine(material, *known->emissive);
    set_texture(material, known->texture, known->texture_directory, place.object);
  }

  // What stands in the world says where a robot may be; a ground plane of any size counts only
  // where there is nothing else.
  void set_floor() {
    Scene bodies;
    for (std::size_t i = 0; i < scene_.meshes.size(); ++i) {
      if (std::find(planes_.begin(), planes_.end(), i) == planes_.end())
        bodies.meshes.push_back(scene_.meshes[i]);
    }
    const auto bounds = bodies.meshes.empty() ? extent(scene_) : extent(bodies);
    scene_.floor_low = {bounds->first.x_m, bounds->first.y_m};
    scene_.floor_high = {bounds->second.x_m, bounds->second.y_m};
  }

  // Gazebo's lamps add up beyond white. As a camera would, this exposes for the brightest floor
  // that lies under a lamp: all light is scaled so that it is 1 there, if it is more.
  void expose() {
    const double floor = extent(scene_)->first.z_m;
    double brightest = 0.0;
    for (const PointLight& above : scene_.lights) {
      double light = scene_.ambient;
      for (const PointLight& lamp : scene_.lights) {
        const double dx = lamp.position.x_m - above.position.x_m;
        const double dy = lamp.position.y_m - above.position.y_m;
        const double dz = lamp.position.z_m - floor;
        const double squared = dx * dx + dy * dy + dz * dz;
        if (!(dz > 0.0)) continue;
        light +=
            lamp.intensity * (dz / std::sqrt(squared)) / (squared + lamp.radius_m * lamp.radius_m);
      }
      brightest = std::max(brightest, light);
    }
    double sun_light = 0.0;
    for (const DirectionalLight& sun : scene_.directional_lights) sun_light += sun.intensity;
    brightest = std::max(brightest, static_cast<double>(scene_.ambient)) + sun_light;
    if (!(brightest > 1.0)) return;
    const auto scale = static_cast<float>(1.0 / brightest);
    scene_.ambient *= scale;
    for (PointLight& lamp : scene_.lights) lamp.intensity *= scale;
    for (DirectionalLight& sun : scene_.directional_lights) sun.intensity *= scale;
  }

  fs::path world_;
  TextureStore textures_;
  MeshLibrary meshes_;
  GazeboFiles files_;
  Scene scene_;
  std::map<const FileMesh*, int> materials_;
  std::vector<std::size_t> planes_;
  std::vector<fs::path> opened_;  // the file that is read and those that include it
  int includes_ = 0;
  std::vector<Warning> warnings_;
  std::map<std::string, std::size_t> warning_of_text_;
  std::size_t texture_warnings_ = 0;  // of those of the textures, how many are taken over
};

}  // namespace

Scene load_gazebo(const fs::path& world, const GazeboOptions& options) {
  std::error_code code;
  if (!fs::is_regular_file(world, code)) throw FileError(world.string(), "no such Gazebo world");
  return WorldReader(world, options).read();
}

}  // namespace panonav::simulation
