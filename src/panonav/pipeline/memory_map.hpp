#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Name under which a memory file stores the map of its views.
inline constexpr const char* map_name = "map";

/// Unit of the positions of a memory, its maps and its routes. Members whose names end in `_m` are
/// in this unit, too.
enum class LengthUnit {
  metres,  ///< of a data set, of odometry, or of a map with a known length
  /// The unit of `compute_view_step`. The map was computed from images alone,
  /// which do not show how long a metre is (`scale_to_metres`).
  view_steps,
};

/// Returns the unit's name for people: "m" or "view steps".
[[nodiscard]] const char* to_string(LengthUnit unit) noexcept;

/// Returns the unit of the memory's positions; metres if it has no positions.
[[nodiscard]] LengthUnit read_length_unit(const MemoryFile& memory);
/// Returns the metres of one unit of the memory's positions; for view steps an assumption by which
/// algorithms choose distances: things around are 1.5 m away, or views of an arrangement 0.3 m
/// apart. 1 for metres.
[[nodiscard]] double read_assumed_unit_m(const MemoryFile& memory);
/// Returns the scale of a map of images in metres: metres for each metre that was assumed while its
/// positions were in view steps. nullopt if the map never was in view steps, or is not in metres.
[[nodiscard]] std::optional<double> read_map_scale(const MemoryFile& memory);
/// Stores the unit of positions that come from a map, and `map_scale` (`read_map_scale`). Throws
/// FileError.
void store_length_unit(MemoryFile& memory, LengthUnit unit, double assumed_unit_m = 1.0,
                       std::optional<double> map_scale = std::nullopt);
/// True if the positions of the views were computed by a map, not read from a data set.
[[nodiscard]] bool has_positions_from_map(const MemoryFile& memory);

/// Returns the poses of the map's nodes in one frame. Connected components have no common frame, so
/// they are placed beside each other, the largest one first, in rows from left to right. Their
/// distances are at least `gap` and have no meaning. `nullopt`: six median steps, which is more
/// than the distance over which positions are interpolated.
[[nodiscard]] std::vector<Pose2> place_components_side_by_side(
    const TopologicalMap& map, std::optional<double> gap = std::nullopt);

/// Multiplies all lengths of a map by `factor`.
void scale_lengths(TopologicalMap& map, double factor);
/// Returns the median length of the edges between consecutive views; nullopt if all are 0.
[[nodiscard]] std::optional<double> median_step_length(const TopologicalMap& map);
/// Returns the unit of a map of images, in its present unit of length: the median length of the
/// edges between consecutive views; of an arrangement, which has none, the median distance between
/// a view and the nearest one of its component. nullopt if there is neither.
[[nodiscard]] std::optional<double> compute_view_step(const TopologicalMap& map);
/// Returns what a view step is in a map, for people: "median distance between ...".
[[nodiscard]] const char* describe_view_step(const TopologicalMap& map) noexcept;

/// Description of the map of a memory's views.
struct MemoryMap {
  std::size_t views = 0;                 ///< number of views in the map
  std::vector<std::size_t> part_sizes;   ///< views of each connected component, the largest first
  LengthUnit unit = LengthUnit::metres;  ///< of the positions
  const char* view_step = "";            ///< what a view step is (`describe_view_step`)
};
/// Describes the map from which the views got their positions; nullopt if they got none from a map.
[[nodiscard]] std::optional<MemoryMap> describe_map(const MemoryFile& memory);

/// Stores a map as the memory's own in one transaction: the map, a link for each edge, the position
/// of each node (`place_components_side_by_side`; none in parts of fewer than
/// `ObservationModel::min_views`), the unit, and models learnt from them. Other views lose their
/// positions, which are in the frame of an earlier map. If the earlier map is in metres and shares
/// views, a map in `view_steps` gets its scale (`compare_lengths`) and is stored in metres;
/// otherwise it is scaled so that its median step has length 1. If a map in metres replaces one in
/// view steps or of another scale, routes in the unit of the map are scaled, too. `assumed_unit_m`:
/// see `read_assumed_unit_m`, for lengths before scaling. Throws FileError.
void store_map(MemoryFile& memory, TopologicalMap map, LengthUnit unit,
               double assumed_unit_m = 1.0);

/// True if the views are in the order of a walk, which may pause, be slow, have gaps or pass places
/// that look alike. The next view must be among the most similar tenth of all views for more
/// views than the mean of a random order plus three standard deviations. And most steps must be in
/// order, by one of two measures that random steps reduce by their share: the similarity of the
/// next view exceeds the average by half as much as that of the two most similar views does; or on
/// average four fifths of all views are less similar. False if the images are too
/// far apart to look alike. Cost: 200 searches.
[[nodiscard]] bool are_in_order(const VisualMemory& views);

/// Returns the views at which the paths of the memory begin, ascending; the first path begins at
/// the first view. A view that was removed stands for the next one. Throws FileError on a bad
/// value.
[[nodiscard]] std::vector<ViewId> read_path_starts(const MemoryFile& memory);
/// Stores that further paths begin at these views: no sequence leads to them from the view before.
void add_path_starts(MemoryFile& memory, std::span<const ViewId> starts);

/// Makes the map of a memory whose views have no positions from data sets, in the order of their
/// ids (`TopologicalMapper`) and of their paths (`read_path_starts`). Views in no order are
/// arranged by similarity instead (`arrange`), or join a path if they were added to paths
/// (`join_small_components`). Replaces an earlier map. Lengths are in metres if odometry is known
/// or the earlier map is in metres.
///
/// `odometry`: poses of views by name. Calls `mapped` after each view. Returns nullopt and
/// changes nothing if a view has a position from a data set or there are fewer than two views.
/// Stores no map if no part has `ObservationModel::min_views` views. Throws FileError. Cost: 0.5 to
/// 10 ms a view.
std::optional<MemoryMap> map_views(MemoryFile& memory, const std::map<std::string, Pose2>& odometry,
                                   Executor& executor, const std::function<void()>& mapped = {});

/// Removes the map and the positions that came from it. Does nothing if positions come from a data
/// set. Throws FileError.
void remove_positions_from_map(MemoryFile& memory);

/// Stores the unit of a map beside views whose positions are of a data set, in metres.
void store_own_map_unit(MemoryFile& memory, LengthUnit unit);
/// Returns the unit of the map's own lengths, which can differ from that of the positions
/// (`read_length_unit`) if these are of a data set.
[[nodiscard]] LengthUnit read_map_unit(const MemoryFile& memory);

/// Throws FileError about `input` if the elevations of the camera are assumed: lengths from the
/// image of the ground would be wrong by an unknown factor.
void require_known_elevations(const PictureSource& source, const std::string& input);

}  // namespace panonav
