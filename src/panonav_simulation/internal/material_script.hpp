#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::simulation {

/// One material of an OGRE script, as far as a Scene can show it.
struct ScriptMaterial {
  std::optional<std::array<float, 3>> diffuse;
  std::optional<std::array<float, 3>> emissive;
  std::string texture;                      ///< as written; "" for none
  std::filesystem::path texture_directory;  ///< where to look for it
};

/// Finds the material `name` in script files and folders (`*.material`); of Gazebo's own
/// materials only the plain colours ("Gazebo/Red") are known without a file. Nullopt if it is not
/// found.
[[nodiscard]] std::optional<ScriptMaterial> find_script_material(
    std::string_view name, const std::vector<std::filesystem::path>& places);

}  // namespace panonav::simulation
