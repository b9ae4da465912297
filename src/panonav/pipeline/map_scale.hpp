#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Scales the map, the positions and the routes in the unit of the map to metres, by the known
/// distance between two views. Returns the metres per former unit. `undo` describes the change for
/// `undo`. Throws ContractError if a view does not exist, the views are not connected in the map or
/// less than three view steps (`compute_view_step`) apart, the distance is not above 0, or
/// positions come from a data set; FileError.
double scale_to_metres(MemoryFile& memory, ViewId a, ViewId b, double distance_m,
                       const std::string& undo);

/// Scale of a map, measured on the ground in its images.
struct GroundScale {
  std::optional<double> unit_m;  ///< metres per unit of the map; nullopt if it is uncertain
  std::size_t measured = 0;      ///< pairs of neighbouring views whose distance the ground shows
  std::size_t tried = 0;         ///< pairs that were compared, at most 300
  /// Relative standard deviation of `unit_m` by the differences between the pairs; 0 for none.
  double deviation = 0.0;
};

/// Compares the distances of neighbouring views in the map with those that the ground in their
/// images shows below a camera at this height. The order of the views is not used. The scale is the
/// median of the ratios; it is uncertain with fewer than 8 pairs, or if its deviation is above 10 %
/// (chosen). Calls `compared` for each pair, with the number of all. Throws ContractError unless
/// the height is above 0; FileError, also as `require_known_elevations`. Cost: 1 to 15 ms a pair.
[[nodiscard]] GroundScale measure_ground_scale(
    const MemoryFile& memory, double camera_height_m,
    const std::function<void(std::size_t)>& compared = {});

/// Scales as the overload above, by the metres per unit of the map. Throws ContractError unless
/// `unit_m` is above 0, or if positions come from a data set; FileError.
void scale_to_metres(MemoryFile& memory, double unit_m, const std::string& undo);

/// Returns the length in `map` of one unit of `known`: the median ratio of the distances between
/// views that are joined by an edge of `known` and in one component of both maps. nullopt with
/// fewer than three such pairs.
[[nodiscard]] std::optional<double> compare_lengths(const TopologicalMap& known,
                                                    const TopologicalMap& map);

/// Multiplies the lengths of routes in the unit of the memory's map by `factor`, the metres per
/// unit of the map. Routes in view steps of their own, of `RouteSource::assumed_unit_m`, are
/// converted to those of the map first; they stay as they are if the map is in metres already.
/// Routes in metres of another scale of the map (`RouteSource::map_scale`), as after `undo` of a
/// scaling, get the new scale; if that of theirs is not known, they stay as they are while the map
/// is in view steps. Returns the new `read_map_scale`, which the caller stores.
std::optional<double> scale_routes(MemoryFile& memory, double factor);

}  // namespace panonav
