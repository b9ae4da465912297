#pragma once

namespace Assimp {
class IOSystem;
}

namespace panonav::simulation {

/// Returns what opens the files that a mesh file names (materials, buffers), and reports all but
/// regular files as missing. The caller takes ownership.
[[nodiscard]] Assimp::IOSystem* make_regular_files();

}  // namespace panonav::simulation
