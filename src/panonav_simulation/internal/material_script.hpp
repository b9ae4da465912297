#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::simulation {

/// One material of an OGRE script, reduced to what a Scene can show.
struct ScriptMaterial {
  std::optional<std::array<float, 3>> diffuse;
  std::optional<std::array<float, 3>> emissive;
  std::string texture;                      ///< as written; empty: none
  std::filesystem::path texture_directory;  ///< folder in which the texture is searched
};

/// Finds the material `name` in script files and folders (`*.material`), else among the plain
/// colours of Gazebo ("Gazebo/Red"), which need no file. nullopt if it is not found.
[[nodiscard]] std::optional<ScriptMaterial> find_script_material(
    std::string_view name, const std::vector<std::filesystem::path>& places);

}  // namespace panonav::simulation
