#include "panonav_simulation/internal/regular_files.hpp"

#include <assimp/DefaultIOSystem.h>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"

namespace panonav::simulation {

namespace {

bool is_scene_file(const char* file) {
  try {
    require_scene_file(file);
    return true;
  } catch (const FileError&) {
    return false;
  }
}

class RegularFiles final : public Assimp::DefaultIOSystem {
 public:
  // The base opens the file, which waits for the writer of a pipe.
  bool Exists(const char* file) const override { return is_scene_file(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return is_scene_file(file) ? Assimp::DefaultIOSystem::Open(file, mode) : nullptr;
  }
};

}  // namespace

Assimp::IOSystem* make_regular_files() {
  return new RegularFiles;
}

}  // namespace panonav::simulation
