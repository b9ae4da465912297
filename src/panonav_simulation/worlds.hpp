#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

/// True if the folder of recordings and Gazebo worlds (docs/formats.md) has this part.
[[nodiscard]] bool has_data(const std::filesystem::path& data, const std::filesystem::path& part);
/// Returns the Gazebo worlds of the experiments that exist.
[[nodiscard]] std::vector<std::string> find_worlds(const std::filesystem::path& data);
/// Returns those, and the worlds that were never used for development.
[[nodiscard]] std::vector<std::string> find_all_worlds(const std::filesystem::path& data);
/// Reads one of these. Throws FileError.
[[nodiscard]] Scene read_world(const std::filesystem::path& data, const std::string& name);

/// True if the name is a built-in scene or an existing world.
[[nodiscard]] bool has_scene(const std::filesystem::path& data, const std::string& name);
/// Returns the variation of a built-in scene; of a world, only its light is varied. Throws
/// FileError.
[[nodiscard]] Scene make_or_read_scene(const std::filesystem::path& data, const std::string& name,
                                       const SceneVariation& variation);

}  // namespace panonav::simulation
