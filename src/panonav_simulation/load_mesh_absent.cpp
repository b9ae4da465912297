#include "panonav/core/error.hpp"
#include "panonav_simulation/load_gazebo.hpp"
#include "panonav_simulation/load_mesh.hpp"

namespace panonav::simulation {

Scene load_mesh(const std::filesystem::path& path, const MeshOptions& /*options*/) {
  throw FileError(path.string(), "mesh files cannot be read: panonav was built without assimp");
}

Scene load_gazebo(const std::filesystem::path& world, const GazeboOptions& /*options*/) {
  throw FileError(world.string(), "Gazebo worlds cannot be read: panonav was built without assimp");
}

}  // namespace panonav::simulation
