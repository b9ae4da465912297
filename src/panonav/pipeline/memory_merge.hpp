#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>

#include "panonav/mapping/session_alignment.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Result of `merge_memories`.
struct MergedMemory {
  std::size_t views = 0;   ///< number of views of the new memory
  std::size_t shared = 0;  ///< number of views that both memories have, stored once
  std::size_t renamed =
      0;  ///< number of views and routes of the second that were renamed because of name conflicts
  /// Pose of the second memory's frame in the frame of the first; nullopt if no common place was
  /// found.
  std::optional<SessionAlignment> alignment;
  std::size_t connected_components = 0;  ///< of the new map
  /// Number of views of the second memory whose positions were dropped, because their frame could
  /// not be related to that of the first.
  std::size_t without_position = 0;
  /// False if each floor is in one of the memories only; its views then keep their positions.
  bool has_shared_floor = true;
};

/// Merges the memories of two sessions or robots in one environment: finds common places by
/// appearance (`align_sessions`) and transforms the second into the frame of the first's poses
/// (`join_sessions`). Moves only their largest connected components, on the floor that both have.
/// Without common places, the second loses its positions there.
///
/// A view with the same name and picture in both is stored once, as in the first. Other names of
/// the second that the first uses become "STEM/NAME". Writes all of `memory` or nothing.
///
/// Throws FileError on unreadable files, if `memory` exists, if several floors are in both, and on
/// positions without headings; ContractError if shape, preprocessing or elevations differ;
/// OptionError. Holds both memories. Cost: `align_sessions`, and writing views twice.
MergedMemory merge_memories(const std::filesystem::path& first, const std::filesystem::path& second,
                            const std::filesystem::path& memory,
                            const SessionAlignmentOptions& alignment = {},
                            const PoseGraphOptions& graph = {},
                            const std::function<void()>& advance = {});

}  // namespace panonav
