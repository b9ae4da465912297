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
  std::size_t views = 0;   ///< of the new memory
  std::size_t shared = 0;  ///< views in both memories, stored once
  std::size_t renamed =
      0;  ///< renamed views and routes of the second, whose names the first uses for others
  /// Pose of the second in the frame of the first; empty if no common place was found.
  std::optional<SessionAlignment> alignment;
  std::size_t connected_components = 0;  ///< of the new map
  /// Number of views of the second that lost their positions, which are in a frame of their own.
  std::size_t without_position = 0;
};

/// Makes one memory of two sessions or robots in one place: finds common places by appearance
/// (`align_sessions`) and moves the second into the frame of the first's poses (`join_sessions`).
/// Only the largest connected component of each map moves. Without common places both stay apart,
/// and the second loses its positions.
///
/// A view with the same name and picture in both is stored once, as in the first; other used
/// names of the second become "STEM/NAME". `memory` appears whole or not at all. `advance` is
/// called for each view written.
///
/// Throws FileError: unreadable or unwritable files, something at `memory`, positions without
/// headings; ContractError: other shape, preprocessing or elevations; OptionError. Holds both
/// memories. Cost: `align_sessions`, and writing all views twice.
MergedMemory merge_memories(const std::filesystem::path& first, const std::filesystem::path& second,
                            const std::filesystem::path& memory,
                            const SessionAlignmentOptions& alignment = {},
                            const PoseGraphOptions& graph = {},
                            const std::function<void()>& advance = {});

}  // namespace panonav
