#include "experiments/runs/worlds.hpp"

#include "panonav/io/image_file.hpp"
#include "panonav/simulation/load_gazebo.hpp"

namespace panonav {

bool has_data(const std::filesystem::path& data, const std::filesystem::path& part) {
  return !data.empty() && std::filesystem::is_directory(data / part);
}

std::vector<std::string> worlds_in(const std::filesystem::path& data) {
  std::vector<std::string> worlds{"small_warehouse", "small_house"};
  std::erase_if(worlds, [&](const std::string& name) {
    return !has_data(data, std::filesystem::path("scenes") / name);
  });
  return worlds;
}

Scene read_world(const std::filesystem::path& data, const std::string& name) {
  GazeboOptions reading;
  reading.textures.read = [](const std::filesystem::path& path) { return read_image(path); };
  return load_gazebo(data / "scenes" / name / "worlds" / (name + ".world"), reading);
}

}  // namespace panonav
