#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "panonav_simulation/scene.hpp"
#include "panonav_simulation/texture_store.hpp"

namespace panonav::simulation {

/// Options for reading a Gazebo world.
struct GazeboOptions {
  TextureOptions textures{};  ///< for textures of surfaces
  /// Folders that are searched for `model://NAME` first. The usual places follow: the folder of the
  /// world file, the two above it, and `models` in each.
  std::vector<std::filesystem::path> model_folders;
  double camera_height_m = 0.6;  ///< for Scene::camera_height_m
  /// Called with the path of each mesh file before it is read. An Error that it throws leaves the
  /// mesh out with a warning. Empty: not called.
  std::function<void(const std::filesystem::path&)> before_mesh = {};
};

/// Returns the model folders of the user's Gazebo installation, from the environment variables
/// GAZEBO_MODEL_PATH, GZ_SIM_RESOURCE_PATH, IGN_GAZEBO_RESOURCE_PATH and SDF_PATH, in this order.
[[nodiscard]] std::vector<std::filesystem::path> gazebo_model_folders_of_environment();

/// Reads a scene from a Gazebo world (SDF 1.0 and later; also a file with a single model): visuals
/// with poses, scales, colours and textures, heightmaps, roads, and skins of actors, which do not
/// move; one object per model. Approximations: coloured lamps become white ones of the
/// same brightness; lights shine to all sides; if their sum is brighter than white on the floor,
/// all are scaled down. Visuals that are more than half transparent and invisible parts
/// (collisions, joints, plugins) are left out. Parts that are missing, faulty or unknown are left
/// out with one line each in Scene::warnings. `model://sun` and `model://ground_plane` need no
/// folder. Throws FileError if the world is missing, no XML or contains nothing visible.
[[nodiscard]] Scene load_gazebo(const std::filesystem::path& world,
                                const GazeboOptions& options = {});

}  // namespace panonav::simulation
