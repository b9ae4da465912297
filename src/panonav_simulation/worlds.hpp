#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

// What of the folder of recordings and Gazebo worlds (docs/formats.md) is there: any part will do.

/// False, too, when there is no such folder `data`.
[[nodiscard]] bool has_data(const std::filesystem::path& data, const std::filesystem::path& part);
/// Of the Gazebo worlds of the experiments those that are there.
[[nodiscard]] std::vector<std::string> find_worlds(const std::filesystem::path& data);
/// Those, and the ones that were never used to develop anything.
[[nodiscard]] std::vector<std::string> find_all_worlds(const std::filesystem::path& data);
/// One of these. Throws FileError.
[[nodiscard]] Scene read_world(const std::filesystem::path& data, const std::string& name);

/// Whether that is a built-in scene or a world that is there.
[[nodiscard]] bool has_scene(const std::filesystem::path& data, const std::string& name);
/// The built-in scene of this seed, or the world. Throws FileError.
[[nodiscard]] Scene make_or_read_scene(const std::filesystem::path& data, const std::string& name,
                                       std::uint64_t seed);

}  // namespace panonav::simulation
