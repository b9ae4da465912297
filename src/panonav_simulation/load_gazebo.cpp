#include "panonav_simulation/load_gazebo.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_simulation/internal/sdf_context.hpp"
#include "panonav_simulation/internal/sdf_visuals.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

constexpr int max_sdf_depth = 32;  // nested models or frames; real files have up to 5

// Returns the inverse of a rigid transform.
Affine3 inverse(const Affine3& b_from_a) {
  const auto& m = b_from_a.matrix;
  Affine3 result{{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}, {}};
  const Vector3 back = result * b_from_a.translation;
  result.translation = {-back.x_m, -back.y_m, -back.z_m};
  return result;
}

// Normalises a model name: "Ground Plane" and ".../ground_plane" are the same model, written
// differently by Gazebo's database and its servers.
std::string normalise_model_name(std::string_view uri) {
  std::string name(uri.substr(uri.find_last_of('/') + 1));
  for (auto at = name.find("%20"); at != std::string::npos; at = name.find("%20"))
    name.replace(at, 3, "_");
  std::ranges::replace(name, ' ', '_');
  return to_lower_case(name);
}

// Returns one of the two models of Gazebo's database that nearly all worlds include, the sun or the
// ground plane; a null node for other names.
pugi::xml_node find_well_known_model(std::string_view uri) {
  static const pugi::xml_document sun = parse_xml(
      "<sdf><light name='sun' type='directional'><pose>0 0 10 0 0 0</pose>"
      "<diffuse>0.8 0.8 0.8 1</diffuse><direction>-0.5 0.1 -0.9</direction></light></sdf>");
  static const pugi::xml_document ground = parse_xml(
      "<sdf><model name='ground_plane'><link name='link'><visual name='visual'><geometry><plane>"
      "<normal>0 0 1</normal><size>100 100</size></plane></geometry><material><script>"
      "<name>Gazebo/Grey</name></script></material></visual></link></model></sdf>");
  const std::string name = normalise_model_name(uri);
  return name == "sun"            ? sun.document_element()
         : name == "ground_plane" ? ground.document_element()
                                  : pugi::xml_node();
}

bool is_element_named(pugi::xml_node part, std::initializer_list<std::string_view> names) {
  return std::ranges::find(names, std::string_view(part.name())) != names.end();
}

// Returns the pose of a frame in its model or world; nullopt if no frame has this name.
std::optional<Affine3> scope_from_frame(pugi::xml_node scope, std::string_view name,
                                        int depth = 0) {
  if (name.empty() || name == "__model__" || name == "world") return Affine3{};
  if (depth > max_sdf_depth) return std::nullopt;
  const auto split = name.find("::");
  for (const pugi::xml_node& part : scope) {
    if (part.attribute("name").value() != name.substr(0, split)) continue;
    if (!is_element_named(part, {"link", "model", "frame", "joint"})) continue;
    std::string base(find_pose_frame(part));
    if (base.empty() && is_element_named(part, {"joint"})) base = child_text(part, "child");
    if (base.empty() && is_element_named(part, {"frame"}))
      base = part.attribute("attached_to").value();
    const auto scope_from_base = scope_from_frame(scope, base, depth + 1);
    if (!scope_from_base) return std::nullopt;
    const Affine3 scope_from_part = *scope_from_base * read_pose(find_pose_element(part));
    if (split == std::string_view::npos) return scope_from_part;
    const auto inner = scope_from_frame(part, name.substr(split + 2), depth + 1);
    return inner ? std::optional(scope_from_part * *inner) : std::nullopt;
  }
  return std::nullopt;
}

bool is_renderable(const Vector3& v) {
  constexpr double max_coordinate_m = 1e6;  // single precision resolves 6 cm there
  return std::abs(v.x_m) <= max_coordinate_m && std::abs(v.y_m) <= max_coordinate_m &&
         std::abs(v.z_m) <= max_coordinate_m;
}

// Returns the light of ambient and lamps on a point of the floor.
double light_on_floor(const Scene& scene, double x_m, double y_m, double floor_m) {
  double light = scene.ambient;
  for (const PointLight& lamp : scene.lights) {
    const double dx = lamp.position.x_m - x_m;
    const double dy = lamp.position.y_m - y_m;
    const double dz = lamp.position.z_m - floor_m;
    const double squared = dx * dx + dy * dy + dz * dz;
    if (!(dz > 0.0)) continue;
    light += lamp.intensity * (dz / std::sqrt(squared)) / (squared + lamp.radius_m * lamp.radius_m);
  }
  return light;
}

// Scales down all light if it is above 1 (white) at the brightest point of the floor under a lamp,
// because Gazebo's lamps add up.
void limit_floor_brightness(Scene& scene) {
  const double floor_m = extent(scene)->first.z_m;
  double brightest = scene.ambient;
  for (const PointLight& lamp : scene.lights) {
    brightest =
        std::max(brightest, light_on_floor(scene, lamp.position.x_m, lamp.position.y_m, floor_m));
  }
  double sun_light = 0.0;
  for (const DirectionalLight& sun : scene.directional_lights) sun_light += sun.intensity;
  brightest += sun_light;
  if (!(brightest > 1.0)) return;
  const auto scale = static_cast<float>(1.0 / brightest);
  scene.ambient *= scale;
  for (PointLight& lamp : scene.lights) lamp.intensity *= scale;
  for (DirectionalLight& sun : scene.directional_lights) sun.intensity *= scale;
}

// Sets the floor area to the extent of all meshes except ground planes; to that of the planes if
// there is nothing else.
void set_floor_extent(Scene& scene, const std::vector<std::size_t>& planes) {
  Scene bodies;
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (std::ranges::find(planes, i) == planes.end()) bodies.meshes.push_back(scene.meshes[i]);
  }
  const auto bounds = bodies.meshes.empty() ? extent(scene) : extent(bodies);
  scene.floor_low = {bounds->first.x_m, bounds->first.y_m};
  scene.floor_high = {bounds->second.x_m, bounds->second.y_m};
}

// Context for reading one element of a world.
struct ElementContext {
  pugi::xml_node scope;  // model or world whose frames the pose may name
  Affine3 world_from_scope;
  SdfOrigin origin;
};

class WorldReader {
 public:
  WorldReader(const fs::path& world, const GazeboOptions& options)
      : world_(world), sdf_context_(world, options) {
    scene_.camera_height_m = options.camera_height_m;
    scene_.ambient = 0.4F;  // defaults of SDF
    scene_.background = {0.7F, 0.7F, 0.7F};
  }

  Scene read() {
    const pugi::xml_node root = sdf_context_.files.read_sdf_root(world_);
    opened_.push_back(world_.lexically_normal());
    const pugi::xml_node world = root.child("world");
    const pugi::xml_node top = world ? world : root;
    const pugi::xml_node named = world ? world : root.child("model");
    scene_.name = named ? named.attribute("name").value() : world_.stem().string();
    const pugi::xml_node scene_element = top.child("scene");
    if (const auto ambient = read_colour(scene_element, "ambient"))
      scene_.ambient = brightness(*ambient);
    if (const auto background = read_colour(scene_element, "background"))
      scene_.background = *background;
    add_parts(top, {top, {}, {world_.parent_path(), {}}});
    const std::vector<std::string> warnings = sdf_context_.warning_lines();
    if (scene_.meshes.empty()) {
      throw FileError(world_.string(),
                      "shows nothing: no visual with a shape" +
                          (warnings.empty() ? std::string() : "; left out: " + warnings.front()));
    }
    set_floor_extent(scene_, visuals_.planes());
    limit_floor_brightness(scene_);
    for (const std::string& warning : warnings)
      scene_.warnings.push_back(world_.string() + ": " + warning);
    return std::move(scene_);
  }

 private:
  // Returns the pose of a part; relative to `world_from_parent` if the part names no frame, or an
  // unknown one.
  Affine3 world_from(pugi::xml_node part, const Affine3& world_from_parent,
                     const ElementContext& context) {
    const std::string_view frame = find_pose_frame(part);
    const Affine3 written = read_pose(find_pose_element(part));
    if (frame.empty()) return world_from_parent * written;
    if (const auto scope_from_base = scope_from_frame(context.scope, frame))
      return context.world_from_scope * *scope_from_base * written;
    sdf_context_.warn(context.origin.object,
                      "the pose of " + quote(part.attribute("name").value()) + " is relative to " +
                          quote(frame) + ", which does not exist; taken relative to its parent");
    return world_from_parent * written;
  }

  // Adds all models, lights and includes of `parent`, in the order of the file.
  void add_parts(pugi::xml_node parent, const ElementContext& context) {
    for (const pugi::xml_node& part : parent) add_part(part, part, context);
  }

  // Adds one part. `placed_by` is the part itself, or the <include> whose name and pose
  // replace those of the part.
  void add_part(pugi::xml_node part, pugi::xml_node placed_by, const ElementContext& context) {
    const std::string kind = part.name();
    const std::string& object = context.origin.object;
    std::string name = child_text(placed_by, "name");
    if (name.empty()) name = part.attribute("name").value();
    const std::string thing = kind + " " + quote(name);
    if (kind == "include") {
      sdf_context_.try_to_add(kind + " " + quote(child_text(part, "uri")), object,
                              [&] { add_include(part, context); });
    } else if (kind == "model") {
      sdf_context_.try_to_add(thing, object, [&] { add_model(part, placed_by, name, context); });
    } else if (kind == "light") {
      sdf_context_.try_to_add(thing, object, [&] {
        const pugi::xml_node posed = find_pose_element(placed_by) ? placed_by : part;
        add_light(part, world_from(posed, context.world_from_scope, context));
      });
    } else if (kind == "road") {
      sdf_context_.try_to_add(thing, object, [&] {
        ElementContext inner = context;
        if (inner.origin.object.empty()) inner.origin.object = name.empty() ? "road" : name;
        add_renderable([&] { visuals_.add_road(part, context.world_from_scope, inner.origin); });
      });
    } else if (kind == "actor") {
      sdf_context_.try_to_add(thing, object, [&] { add_actor(part, placed_by, name, context); });
    } else if (kind == "population") {
      sdf_context_.warn(object, thing + " is left out: panonav shows nothing of this kind");
    }
  }

  // Adds the skin of an actor where its first trajectory begins; at its own pose if it has none.
  // Waypoints are poses in the world, which replace the pose of the actor, as in Gazebo.
  void add_actor(pugi::xml_node actor, pugi::xml_node placed_by, const std::string& name,
                 const ElementContext& context) {
    const pugi::xml_node skin = actor.child("skin");
    if (!skin) throw UnusablePart{"it has no skin"};
    SdfOrigin origin = context.origin;
    if (origin.object.empty()) origin.object = name;
    const pugi::xml_node waypoint =
        actor.child("script").child("trajectory").child("waypoint").child("pose");
    const Affine3 world_from_actor =
        waypoint ? read_pose(waypoint)
                 : world_from(find_pose_element(placed_by) ? placed_by : actor,
                              context.world_from_scope, context);
    add_renderable([&] { visuals_.add_skin(skin, world_from_actor, origin); });
    sdf_context_.warn(origin.object, "actors do not move; they stand where their path begins");
  }

  // Returns the root of the file that an <include> names, and its path; an empty path for
  // well-known models.
  std::pair<pugi::xml_node, fs::path> open_include(const std::string& uri,
                                                   const ElementContext& context) {
    constexpr int max_includes = 100000;
    const auto found = sdf_context_.find(uri, context.origin);
    if (!found) {
      const pugi::xml_node known = find_well_known_model(uri);
      if (!known) throw UnusablePart{"it was not found in " + sdf_context_.files.list_folders()};
      return {known, {}};
    }
    std::error_code code;
    fs::path file = fs::is_directory(*found, code) ? GazeboFiles::find_description(*found) : *found;
    file = file.lexically_normal();
    if (std::ranges::find(opened_, file) != opened_.end())
      throw UnusablePart{"it includes itself, directly or through other models"};
    if (opened_.size() >= max_sdf_depth)
      throw UnusablePart{"it is included more than 32 models deep"};
    if (++includes_ > max_includes)
      throw UnusablePart{"the world includes more than 100000 models in all"};
    return {sdf_context_.files.read_sdf_root(file), file};
  }

  void add_include(pugi::xml_node include, const ElementContext& context) {
    const auto [root, file] = open_include(child_text(include, "uri"), context);
    ElementContext inner_context = context;
    if (!file.empty()) inner_context.origin.directory = file.parent_path();
    // Take the first model, light or actor, as Gazebo does.
    const pugi::xml_node part = root.find_child([](pugi::xml_node child) {
      return is_element_named(child, {"model", "light", "actor"});
    });
    if (!part) throw UnusablePart{"its file holds no model, light or actor"};
    opened_.push_back(file);
    add_part(part, include, inner_context);
    opened_.pop_back();
  }

  void add_model(pugi::xml_node model, pugi::xml_node placed_by, const std::string& name,
                 const ElementContext& context) {
    ElementContext inner_context = context;
    inner_context.scope = model;
    if (inner_context.origin.object.empty()) inner_context.origin.object = name;
    inner_context.world_from_scope = world_from(find_pose_element(placed_by) ? placed_by : model,
                                                context.world_from_scope, context);
    std::string anchor = child_text(placed_by, "placement_frame");
    if (anchor.empty()) anchor = model.attribute("placement_frame").value();
    if (const auto model_from_anchor = scope_from_frame(model, anchor))
      inner_context.world_from_scope = inner_context.world_from_scope * inverse(*model_from_anchor);
    for (const pugi::xml_node& link : model.children("link")) {
      sdf_context_.try_to_add("link " + quote(link.attribute("name").value()),
                              inner_context.origin.object, [&] { add_link(link, inner_context); });
    }
    add_parts(model, inner_context);
  }

  void add_link(pugi::xml_node link, const ElementContext& context) {
    const Affine3 world_from_link = world_from(link, context.world_from_scope, context);
    for (const pugi::xml_node& part : link) {
      if (!is_element_named(part, {"visual", "light"})) continue;
      const std::string kind = part.name();
      sdf_context_.try_to_add(
          kind + " " + quote(part.attribute("name").value()), context.origin.object, [&] {
            const Affine3 world_from_part = world_from(part, world_from_link, context);
            if (kind == "light") return add_light(part, world_from_part);
            add_visual(part, world_from_part, context);
          });
    }
  }

  void add_visual(pugi::xml_node visual, const Affine3& world_from_visual,
                  const ElementContext& context) {
    add_renderable([&] { visuals_.add(visual, world_from_visual, context.origin); });
  }

  // Calls `add` and takes back its meshes if they reach too far.
  template <class Add>
  void add_renderable(const Add& add) {
    const std::size_t meshes_before = scene_.meshes.size();
    add();
    for (std::size_t i = meshes_before; i < scene_.meshes.size(); ++i) {
      if (std::ranges::all_of(scene_.meshes[i].vertices, is_renderable)) continue;
      scene_.meshes.resize(meshes_before);
      throw UnusablePart{"it reaches farther than 1000 km"};
    }
  }

  void add_light(pugi::xml_node light, const Affine3& world_from_light) {
    const float strength =
        brightness(read_colour(light, "diffuse").value_or(Colour{1.0F, 1.0F, 1.0F})) *
        static_cast<float>(read_number(light, "intensity", 1.0));
    if (std::string_view(light.attribute("type").value()) == "directional") {
      const auto d = child_text(light, "direction").empty() ? std::vector{0.0, 0.0, -1.0}
                                                            : read_size(light, "direction", 3);
      Affine3 turn = world_from_light;
      turn.translation = {};
      const Vector3 away = turn * Vector3{d[0], d[1], d[2]};
      if (away == Vector3{}) return;
      scene_.directional_lights.push_back({{-away.x_m, -away.y_m, -away.z_m}, strength});
      return;
    }
    const auto factor = [&](const char* name, double otherwise) {
      return std::max(0.0, read_number(light.child("attenuation"), name, otherwise));
    };
    // Gazebo's 1 / (c + l d + q d^2) equals our intensity / (d^2 + radius^2) except for the linear
    // term; it is added to the quadratic one so that both agree at 2 m, a typical distance from a
    // lamp to furniture. A lamp without attenuation gets a radius of 100 m.
    const double c = factor("constant", 1.0);
    const double q = factor("quadratic", 0.0) + 0.5 * factor("linear", 1.0);
    const double fade = std::max(q, 1e-4 * c);
    if (!(fade > 0.0)) throw UnusablePart{"it has no attenuation that is larger than 0"};
    scene_.lights.push_back({world_from_light.translation, static_cast<float>(strength / fade),
                             static_cast<float>(std::sqrt(c / fade))});
  }

  fs::path world_;
  SdfContext sdf_context_;
  Scene& scene_ = sdf_context_.scene;
  SdfVisuals visuals_{sdf_context_};
  std::vector<fs::path> opened_;  // the file being read and those that include it
  int includes_ = 0;
};

}  // namespace

Scene load_gazebo(const fs::path& world, const GazeboOptions& options) {
  std::error_code code;
  if (!fs::is_regular_file(world, code)) throw FileError(world.string(), "no such Gazebo world");
  return WorldReader(world, options).read();
}

}  // namespace panonav::simulation
