#include "panonav/core/error.hpp"
#include "panonav/simulation/load_gazebo.hpp"

namespace panonav {

Scene load_gazebo(const std::filesystem::path& world, const GazeboOptions& /*options*/) {
  throw FileError(world.string(),
                  "Gazebo worlds cannot be read: panonav was built without sdformat or assimp");
}

}  // namespace panonav
