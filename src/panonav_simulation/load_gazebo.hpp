#pragma once

#include <filesystem>
#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/texture_store.hpp"

namespace panonav::simulation {

/// Options of reading a Gazebo world.
struct GazeboOptions {
  TextureOptions textures{};  ///< how pictures on surfaces are read
  /// Folders in which `model://NAME` is looked for, before the usual places: `models` beside the
  /// world file and beside its folder, and these two folders themselves.
  std::vector<std::filesystem::path> model_folders;
  double camera_height_m = 0.6;  ///< for Scene::camera_height_m
};

/// Returns the model folders that the user's Gazebo would use: GAZEBO_MODEL_PATH,
/// GZ_SIM_RESOURCE_PATH, IGN_GAZEBO_RESOURCE_PATH and SDF_PATH of the environment, in this order.
[[nodiscard]] std::vector<std::filesystem::path> gazebo_model_folders_of_environment();

/// Reads a scene from a Gazebo world (SDF 1.0 and later; a file with a single model as well):
/// visuals with their poses, scales, colours and textures; one object per top-level model.
/// Approximations: coloured lamps become white ones of the same brightness; point and spot lights
/// shine to all sides; light that adds up beyond white on the floor is scaled down as a whole.
/// Visuals that are more than half transparent and invisible parts (collisions, joints, plugins)
/// are left out. Whatever is missing, faulty or unknown (actors, height maps) is left out with one
/// line in Scene::warnings. `model://sun` and `model://ground_plane` need no folder. Throws
/// FileError on a world that is missing, no XML or shows nothing.
[[nodiscard]] Scene load_gazebo(const std::filesystem::path& world,
                                const GazeboOptions& options = {});

}  // namespace panonav::simulation
