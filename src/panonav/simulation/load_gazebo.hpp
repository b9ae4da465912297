#pragma once

#include <filesystem>
#include <vector>

#include "panonav/simulation/scene.hpp"
#include "panonav/simulation/texture_store.hpp"

namespace panonav {

struct GazeboOptions {
  TextureOptions textures{};
  /// Folders in which `model://NAME` is looked for, before the usual places: `models` beside the
  /// world file and beside its folder, and these two folders themselves.
  std::vector<std::filesystem::path> model_folders;
  double camera_height_m = 0.6;  ///< for Scene::camera_height_m
};

/// Model folders that the user's Gazebo would use: GAZEBO_MODEL_PATH, GZ_SIM_RESOURCE_PATH,
/// IGN_GAZEBO_RESOURCE_PATH and SDF_PATH of the environment, in this order.
[[nodiscard]] std::vector<std::filesystem::path> gazebo_model_folders_of_environment();

/// A scene from a Gazebo world (SDF 1.0 and later; a file with a single model as well): visuals
/// with their poses, scales, colours and textures; one object per top-level model. Approximations:
/// coloured lamps become white ones of the same brightness; point and spot lights shine to all
/// sides; light that adds up beyond white on the floor is scaled down as a whole. Visuals that are
/// more than half transparent and plugins are left out; actors and height maps too, with a warning.
/// Missing textures are warnings. Throws FileError on a world, model or mesh file that is missing
/// or damaged, and when panonav was built without sdformat or assimp. Not for several threads at
/// once: the SDF parser keeps global state (and a log file in the user's home).
[[nodiscard]] Scene load_gazebo(const std::filesystem::path& world,
                                const GazeboOptions& options = {});

}  // namespace panonav
