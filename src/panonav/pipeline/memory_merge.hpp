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
  std::size_t views = 0;    ///< of the new memory
  std::size_t shared = 0;   ///< views that both had, kept once
  std::size_t renamed = 0;  ///< views and routes of the second whose names the first had for others
  /// How the second lies in the frame of the first; empty where no place in common was found.
  std::optional<SessionAlignment> alignment;
  std::size_t connected_components = 0;  ///< of the new map
  /// Views of the second whose positions are not kept, because they are in a frame of their own.
  std::size_t without_position = 0;
};

/// Makes one memory of two sessions or robots in one place. Places in common are found by
/// appearance
/// (`align_sessions`), and the second memory is moved into the frame of the first
/// (`join_sessions`), which is that of its views' poses. The largest connected component of each
/// map takes part; the others are kept as they are.
///
/// Where nothing in common is found, both stay connected components, and the views of the second
/// lose their positions. Views with the same name and picture are kept once, as the first knows
/// them; other views of the second whose name is used become "STEM/NAME", after its file.
///
/// `memory` appears whole or not at all. `advance` is called for each view that was written.
/// Throws FileError: a file that cannot be read or written, something at `memory`, a map whose
/// views have positions but not all of them headings; ContractError on memories of another shape,
/// preprocessing or elevations; OptionError. Holds both memories in RAM. Cost: that of
/// `align_sessions`, and of writing all views.
MergedMemory merge_memories(const std::filesystem::path& first, const std::filesystem::path& second,
                            const std::filesystem::path& memory,
                            const SessionAlignmentOptions& alignment = {},
                            const PoseGraphOptions& graph = {},
                            const std::function<void()>& advance = {});

}  // namespace panonav
