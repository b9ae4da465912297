#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

/// True if the folder of recordings and Gazebo worlds (docs/formats.md) contains the folder `part`.
[[nodiscard]] bool has_data(const std::filesystem::path& data, const std::filesystem::path& part);
/// Returns the names of the available Gazebo worlds used for development.
[[nodiscard]] std::vector<std::string> find_worlds(const std::filesystem::path& data);
/// Returns the names of all available Gazebo worlds, including those never used for development.
[[nodiscard]] std::vector<std::string> list_available_worlds(const std::filesystem::path& data);
/// Reads the Gazebo world `name`. Throws FileError.
[[nodiscard]] Scene read_gazebo_world(const std::filesystem::path& data, const std::string& name);

/// True if `name` is a built-in scene or an available world.
[[nodiscard]] bool has_scene(const std::filesystem::path& data, const std::string& name);
/// Makes a variation of a built-in scene, or reads a world, of which only the light is varied.
/// Throws FileError.
[[nodiscard]] Scene make_or_read_scene(const std::filesystem::path& data, const std::string& name,
                                       const SceneVariation& variation);

}  // namespace panonav::simulation
