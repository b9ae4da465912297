#include "panonav_simulation/worlds.hpp"

#include <algorithm>

#include "panonav/io/image_file.hpp"
#include "panonav_simulation/load_gazebo.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

bool has_data(const std::filesystem::path& data, const std::filesystem::path& part) {
  return !data.empty() && std::filesystem::is_directory(data / part);
}

namespace {

std::vector<std::string> filter_available_worlds(const std::filesystem::path& data,
                                                 std::vector<std::string> worlds) {
  std::erase_if(worlds, [&](const std::string& name) {
    return !has_data(data, std::filesystem::path("scenes") / name);
  });
  return worlds;
}

}  // namespace

std::vector<std::string> find_worlds(const std::filesystem::path& data) {
  return filter_available_worlds(data, {"small_warehouse", "small_house"});
}

std::vector<std::string> list_available_worlds(const std::filesystem::path& data) {
  return filter_available_worlds(data, {"small_warehouse", "small_house", "industrial_warehouse"});
}

Scene read_gazebo_world(const std::filesystem::path& data, const std::string& name) {
  const std::filesystem::path folder = data / "scenes" / name / "worlds";
  std::filesystem::path world = folder / (name + ".world");
  std::error_code ignored;
  if (!std::filesystem::exists(world, ignored)) {
    // The folder may contain one world of another name.
    for (const auto& file : std::filesystem::directory_iterator(folder, ignored)) {
      if (file.path().extension() == ".world") world = file.path();
    }
  }
  GazeboOptions gazebo_options;
  gazebo_options.textures.read = [](const std::filesystem::path& path) { return read_image(path); };
  return load_gazebo(world, gazebo_options);
}

namespace {

bool is_built_in_scene(const std::string& name) {
  return std::ranges::find(scene_names(), name) != scene_names().end();
}

}  // namespace

bool has_scene(const std::filesystem::path& data, const std::string& name) {
  return is_built_in_scene(name) || !filter_available_worlds(data, {name}).empty();
}

Scene make_or_read_scene(const std::filesystem::path& data, const std::string& name,
                         const SceneVariation& variation) {
  if (is_built_in_scene(name)) return make_scene(name, variation);
  Scene scene = read_gazebo_world(data, name);
  if (variation.light != 1.0) scale_light(scene, variation.light);
  return scene;
}

}  // namespace panonav::simulation
