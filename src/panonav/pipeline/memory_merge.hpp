#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>

#include "panonav/mapping/session_alignment.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// What `merge_memories` made.
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

/// Makes one memory of two: of two sessions or two robots in one place. Places in common are found
/// by appearance (`align_sessions`), and the second is moved into the frame of the first
/// (`join_sessions`). The frame of a memory is that of its views' poses; where a map was kept, its
/// edges tell what hangs together, else the order of the views. Of a map's connected components the
/// largest takes part; the others stay what they are.
///
/// Where nothing in common is found the map keeps both as connected components, and the views of
/// the second lose their positions, which are in another frame: a place is then known by name and
/// not by position. Views with the same name and picture are kept once, with what the first knows
/// of them; others of the second whose name is taken are called "STEM/NAME", after its file.
/// Nothing else is dropped: `select_references` finds what has become redundant.
///
/// `alignment` decides which places are in common, `graph` how the joined map is optimised.
/// `memory` appears whole or not at all. `advance` is called for each view that was written. Throws
/// FileError: a file that cannot be read or written, something at `memory`, a memory whose views of
/// the map have positions and not all of them headings, as these are in another frame than the map;
/// ContractError on two memories whose views cannot be compared (another shape, preprocessing or
/// elevations), OptionError. Holds both memories in RAM. Cost: that of `align_sessions`, and of
/// writing all views.
MergedMemory merge_memories(const std::filesystem::path& first, const std::filesystem::path& second,
                            const std::filesystem::path& memory,
                            const SessionAlignmentOptions& alignment = {},
                            const PoseGraphOptions& graph = {},
                            const std::function<void()>& advance = {});

}  // namespace panonav
