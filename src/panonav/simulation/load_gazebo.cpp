#include "panonav/simulation/load_gazebo.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <sdf/sdf.hh>
#include <sstream>

#ifdef PANONAV_WITH_CONSOLE_BRIDGE
#include <console_bridge/console.h>
#endif

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/simulation/internal/gazebo_files.hpp"
#include "panonav/simulation/internal/material_script.hpp"
#include "panonav/simulation/internal/mesh_library.hpp"
#include "panonav/simulation/internal/shapes.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

// The parser and the one that it tries when it fails write to standard error. This keeps what the
// first one says for the error that is thrown, and silences the second.
class ConsoleCapture {
 public:
  ConsoleCapture() : stream_(console().GetStream()) {
    console().SetStream(&text_);
#ifdef PANONAV_WITH_CONSOLE_BRIDGE
    console_bridge::noOutputHandler();
#endif
  }
  ~ConsoleCapture() {
    console().SetStream(stream_);
#ifdef PANONAV_WITH_CONSOLE_BRIDGE
    console_bridge::restorePreviousOutputHandler();
#endif
  }
  ConsoleCapture(const ConsoleCapture&) = delete;
  ConsoleCapture& operator=(const ConsoleCapture&) = delete;

  // The first message, without the colours for a terminal and the place in the parser's source.
  [[nodiscard]] std::string first_message() const {
    std::string line = text_.str();
    line.erase(std::min(line.find('\n'), line.size()));
    if (const auto end = line.find("\x1b[0m"); end != std::string::npos) line.erase(0, end + 4);
    line.erase(0, std::min(line.find_first_not_of(' '), line.size()));
    return line;
  }

 private:
  static sdf::Console::ConsoleStream& console() {
    return sdf::Console::Instance()->GetMsgStream();
  }

  std::ostringstream text_;
  std::ostream* stream_;
};

// What is wrong with masses, joints and sensors cannot be seen.
bool can_be_seen(const sdf::Error& error) {
  switch (error.Code()) {
    case sdf::ErrorCode::LINK_INERTIA_INVALID:
    case sdf::ErrorCode::JOINT_PARENT_LINK_INVALID:
    case sdf::ErrorCode::JOINT_CHILD_LINK_INVALID:
    case sdf::ErrorCode::JOINT_PARENT_SAME_AS_CHILD:
      return false;
    default:
      return true;
  }
}

// The parser closes a list of errors with one that only repeats that there were some.
bool is_summary(const sdf::Error& error) {
  return error.Code() == sdf::ErrorCode::ELEMENT_INVALID &&
         error.Message().rfind("Failed to load a ", 0) == 0;
}

void throw_first(const sdf::Errors& errors, const fs::path& world, const std::string& detail = {}) {
  const sdf::Error* first = nullptr;
  for (const sdf::Error& error : errors) {
    if (!can_be_seen(error) || (is_summary(error) && errors.size() > 1)) continue;
    first = &error;
    break;
  }
  if (first == nullptr) return;
  std::string where = first->FilePath().value_or(world.string());
  if (first->LineNumber()) where += ":" + std::to_string(*first->LineNumber());
  throw FileError(where, "not a readable Gazebo world: " + readable_line(first->Message()) +
                             (detail.empty() ? "" : "; ") + readable_line(detail));
}

// The types of the mathematics library differ in name between versions of the parser.
template <class Pose>
Affine3 affine(const Pose& pose) {
  const auto& q = pose.Rot();
  const double w = q.W();
  const double x = q.X();
  const double y = q.Y();
  const double z = q.Z();
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
           2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
           2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)},
          {pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z()}};
}

template <class Colour>
std::array<float, 3> rgb(const Colour& colour) {
  const auto clamp = [](float value) {
    return std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0.0F;
  };
  return {clamp(colour.R()), clamp(colour.G()), clamp(colour.B())};
}

float brightness(const std::array<float, 3>& c) {
  return 0.299F * c[0] + 0.587F * c[1] + 0.114F * c[2];
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

class WorldReader {
 public:
  WorldReader(const fs::path& world, const GazeboOptions& options)
      : world_(world),
        textures_(options.textures),
        meshes_(textures_),
        files_(world, options.model_folders) {
    scene_.camera_height_m = options.camera_height_m;
  }

  Scene read() {
    const ConsoleCapture console;
    files_.check_includes();
    sdf::ParserConfig config;
    config.SetFindCallback([this](const std::string& uri) {
      const auto found = files_.resolve(uri, world_.parent_path());
      std::error_code code;
      if (!found || fs::is_directory(*found, code)) return found ? found->string() : std::string();
      return fs::is_regular_file(*found, code) ? found->string() : std::string();
    });
    sdf::Root root;
    const sdf::Errors errors = root.Load(world_.string(), config);
    throw_first(errors, world_, console.first_message());
    if (root.WorldCount() > 0) {
      add_world(*root.WorldByIndex(0));
    } else if (root.Model() != nullptr) {
      scene_.name = root.Model()->Name();
      add_model(*root.Model(), {}, root.Model()->Name());
    } else {
      throw FileError(world_.string(), "holds neither a world nor a model");
    }
    if (scene_.meshes.empty())
      throw FileError(world_.string(), "shows nothing: no visual with a shape");
    set_floor();
    expose();
    scene_.warnings.insert(scene_.warnings.end(), textures_.warnings().begin(),
                           textures_.warnings().end());
    return std::move(scene_);
  }

 private:
  template <class Semantic>
  Affine3 pose_of(const Semantic& part) const {
    auto pose = part.RawPose();
    throw_first(part.SemanticPose().Resolve(pose), world_);
    const Affine3 result = affine(pose);
    for (const double value : result.matrix) {
      if (!std::isfinite(value))
        throw FileError(world_.string(), "pose of \"" + part.Name() + "\" is not finite");
    }
    return result;
  }

  void add_world(const sdf::World& world) {
    scene_.name = world.Name();
    if (const auto* look = world.Scene()) {
      scene_.ambient = brightness(rgb(look->Ambient()));
      scene_.background = rgb(look->Background());
    } else {
      scene_.ambient = 0.4F;  // SDF's own defaults
      scene_.background = {0.7F, 0.7F, 0.7F};
    }
    for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
      const sdf::Model& model = *world.ModelByIndex(i);
      add_model(model, {}, model.Name());
    }
    for (std::uint64_t i = 0; i < world.LightCount(); ++i) add_light(*world.LightByIndex(i), {});
    if (world.ActorCount() > 0) warn("actors are not shown");
  }

  void add_model(const sdf::Model& model, const Affine3& world_from_parent,
                 const std::string& object) {
    const Affine3 world_from_model = world_from_parent * pose_of(model);
    for (std::uint64_t i = 0; i < model.LinkCount(); ++i) {
      const sdf::Link& link = *model.LinkByIndex(i);
      const Affine3 world_from_link = world_from_model * pose_of(link);
      for (std::uint64_t k = 0; k < link.VisualCount(); ++k) {
        add_visual(*link.VisualByIndex(k), world_from_link, object);
      }
      for (std::uint64_t k = 0; k < link.LightCount(); ++k) {
        add_light(*link.LightByIndex(k), world_from_link);
      }
    }
    for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
      add_model(*model.ModelByIndex(i), world_from_model, object);
    }
  }

  void add_light(const sdf::Light& light, const Affine3& world_from_parent) {
    const Affine3 world_from_light = world_from_parent * pose_of(light);
    const float strength = brightness(rgb(light.Diffuse())) * static_cast<float>(light.Intensity());
    if (light.Type() == sdf::LightType::DIRECTIONAL) {
      const auto& d = light.Direction();
      Affine3 turn = world_from_light;
      turn.translation = {};
      const Vector3 away = turn * Vector3{d.X(), d.Y(), d.Z()};
      if (away == Vector3{}) return;
      scene_.directional_lights.push_back({{-away.x_m, -away.y_m, -away.z_m}, strength});
      return;
    }
    // Gazebo's 1 / (c + l d + q d^2) is our intensity / (d^2 + radius^2) but for the linear term,
    // which is taken into the quadratic one so that both agree at 2 m, about the way from a lamp to
    // furniture. A lamp that does not fade is one of 100 m radius.
    const double c = std::max(0.0, light.ConstantAttenuationFactor());
    const double q = std::max(0.0, light.QuadraticAttenuationFactor()) +
                     0.5 * std::max(0.0, light.LinearAttenuationFactor());
    const double fade = std::max(q, 1e-4 * c);
    if (!(fade > 0.0)) {
      warn("light \"" + light.Name() +
           "\" has no attenuation that is larger than 0 and is left out");
      return;
    }
    scene_.lights.push_back({world_from_light.translation, static_cast<float>(strength / fade),
                             static_cast<float>(std::sqrt(c / fade))});
  }

  void add_visual(const sdf::Visual& visual, const Affine3& world_from_link,
                  const std::string& object) {
    if (visual.Geom() == nullptr || visual.Transparency() > 0.5F) return;
    const Affine3 world_from_visual = world_from_link * pose_of(visual);
    const sdf::Geometry& geometry = *visual.Geom();
    if (const auto* mesh = geometry.MeshShape()) {
      add_mesh_file(*mesh, visual, world_from_visual, object);
    } else if (const auto* box = geometry.BoxShape()) {
      add_shape(box_mesh({box->Size().X(), box->Size().Y(), box->Size().Z()}), visual,
                world_from_visual, object);
    } else if (const auto* cylinder = geometry.CylinderShape()) {
      add_shape(cylinder_mesh(cylinder->Radius(), cylinder->Length()), visual, world_from_visual,
                object);
    } else if (const auto* sphere = geometry.SphereShape()) {
      const double r = sphere->Radius();
      add_shape(ellipsoid_mesh({r, r, r}), visual, world_from_visual, object);
    } else if (const auto* ellipsoid = geometry.EllipsoidShape()) {
      const auto& r = ellipsoid->Radii();
      add_shape(ellipsoid_mesh({r.X(), r.Y(), r.Z()}), visual, world_from_visual, object);
    } else if (const auto* capsule = geometry.CapsuleShape()) {
      add_shape(capsule_mesh(capsule->Radius(), capsule->Length()), visual, world_from_visual,
                object);
    } else if (const auto* plane = geometry.PlaneShape()) {
      const auto& n = plane->Normal();
      add_shape(rectangle_mesh(plane->Size().X(), plane->Size().Y()), visual,
                world_from_visual * turned_to({n.X(), n.Y(), n.Z()}), object);
      planes_.push_back(scene_.meshes.size() - 1);
    } else if (geometry.Type() != sdf::GeometryType::EMPTY) {
      warn("visual \"" + visual.Name() + "\" of \"" + object +
           "\" has a geometry that is not shown");
    }
  }

  void add_shape(const Mesh& mesh, const sdf::Visual& visual, const Affine3& world_from_visual,
                 const std::string& object) {
    scene_.materials.push_back(dressed({}, visual));
    place_mesh(scene_, mesh, world_from_visual, object,
               static_cast<int>(scene_.materials.size()) - 1);
  }

  void add_mesh_file(const sdf::Mesh& mesh, const sdf::Visual& visual,
                     const Affine3& world_from_visual, const std::string& object) {
    const fs::path directory = fs::path(mesh.FilePath()).parent_path();
    const auto path = files_.resolve(mesh.Uri(), directory);
    if (!path) {
      throw FileError(mesh.FilePath().empty() ? world_.string() : mesh.FilePath(),
                      "mesh \"" + mesh.Uri() + "\" of \"" + object +
                          "\" was not found; looked in " + files_.places());
    }
    const std::vector<FileMesh>& parts = meshes_.read(*path);
    std::vector<const FileMesh*> wanted;
    for (const FileMesh& part : parts) {
      if (mesh.Submesh().empty() || part.node == mesh.Submesh() ||
          part.geometry == mesh.Submesh()) {
        wanted.push_back(&part);
      }
    }
    if (wanted.empty()) {
      throw FileError(path->string(),
                      "has no part \"" + mesh.Submesh() + "\", which \"" + object + "\" shows");
    }
    Affine3 world_from_mesh =
        world_from_visual * Affine3::scaling(mesh.Scale().X(), mesh.Scale().Y(), mesh.Scale().Z());
    if (!mesh.Submesh().empty() && mesh.CenterSubmesh())
      world_from_mesh = world_from_mesh * centring(wanted);
    for (const FileMesh* part : wanted) {
      place_mesh(scene_, part->mesh, world_from_mesh, object, material_index(*part, visual));
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
  int material_index(const FileMesh& part, const sdf::Visual& visual) {
    if (visual.Material() == nullptr) {
      const auto known = materials_.find(&part);
      if (known != materials_.end()) return known->second;
    }
    scene_.materials.push_back(dressed(part.material, visual));
    const int index = static_cast<int>(scene_.materials.size()) - 1;
    if (visual.Material() == nullptr) materials_.emplace(&part, index);
    return index;
  }

  // The material of a mesh with what the visual's <material> says on top.
  Material dressed(Material material, const sdf::Visual& visual) {
    const sdf::Material* sdf_material = visual.Material();
    if (sdf_material == nullptr) return material;
    const fs::path directory = fs::path(sdf_material->FilePath()).parent_path();
    const auto given = [sdf_material](const char* name) {
      return sdf_material->Element() && sdf_material->Element()->HasElement(name);
    };
    if (given("diffuse")) {
      material.colour = rgb(sdf_material->Diffuse());
    } else if (given("ambient")) {
      material.colour = rgb(sdf_material->Ambient());
    }
    if (given("emissive")) shine(material, rgb(sdf_material->Emissive()));
    if (!sdf_material->ScriptName().empty()) apply_script(material, *sdf_material, directory);
    if (const auto* pbr = sdf_material->PbrMaterial()) {
      for (const auto type : {sdf::PbrWorkflowType::METAL, sdf::PbrWorkflowType::SPECULAR}) {
        const auto* workflow = pbr->Workflow(type);
        if (workflow != nullptr) set_texture(material, workflow->AlbedoMap(), directory);
      }
    }
    return material;
  }

  static void shine(Material& material, const std::array<float, 3>& emissive) {
    if (brightness(emissive) <= brightness(material.colour)) return;
    material.colour = emissive;
    material.emission = 1.0F;
  }

  void set_texture(Material& material, const std::string& written, const fs::path& directory) {
    if (written.empty()) return;
    const auto path = files_.resolve(written, directory);
    const auto texture =
        path ? textures_.find(path->string(), directory) : textures_.find(written, directory);
    if (!texture) return;
    material.texture = texture;
    material.colour = {1.0F, 1.0F, 1.0F};
  }

  void apply_script(Material& material, const sdf::Material& sdf_material,
                    const fs::path& directory) {
    std::vector<fs::path> places;
    if (const auto place = files_.resolve(sdf_material.ScriptUri(), directory))
      places.push_back(*place);
    // Models list the folders of their scripts and textures as several <uri>; they lie side by
    // side.
    places.push_back(directory / "materials/scripts");
    const auto script = find_script_material(sdf_material.ScriptName(), places);
    if (!script) {
      warn("material script \"" + sdf_material.ScriptName() +
           "\" was not found; a plain colour is shown instead");
      return;
    }
    material = Material{};
    if (script->diffuse) material.colour = *script->diffuse;
    if (script->emissive) shine(material, *script->emissive);
    set_texture(material, script->texture, script->texture_directory);
  }

  void warn(const std::string& what) {
    const std::string line = world_.string() + ": " + what;
    auto& warnings = scene_.warnings;
    if (std::find(warnings.begin(), warnings.end(), line) == warnings.end())
      warnings.push_back(line);
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
};

}  // namespace

Scene load_gazebo(const fs::path& world, const GazeboOptions& options) {
  std::error_code code;
  if (!fs::is_regular_file(world, code)) throw FileError(world.string(), "no such Gazebo world");
  return WorldReader(world, options).read();
}

}  // namespace panonav
