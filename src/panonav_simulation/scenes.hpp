#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "panonav/core/options.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

/// Differences between two scenes of the same name. The same variation gives the same scene.
struct SceneVariation {
  std::uint64_t seed = 1;        ///< of textures and furniture
  double moved_objects = 0.0;    ///< share of the movable objects that are moved, 0 .. 1
  std::uint64_t moved_seed = 1;  ///< of the choice and motion of moved objects
  double light = 1.0;            ///< factor of all lamps and the sky, > 0
  friend bool operator==(const SceneVariation&, const SceneVariation&) = default;
};

/// Returns the names of the built-in scenes:
/// - office: 5 x 2 m of free floor amid desks and shelves, as in [M04] and [M03]
/// - hall: 7 x 7 m of free floor in a hall with things along its walls
/// - hall_periodic: the same with pillars and pictures repeated every 2 m
/// - arena: 1.4 x 1.2 m of table with toy houses, camera 8 cm above it, as in [S06]
/// - lab: a 7 x 5 m room, for [Y03] and [S06] section 3
/// - loop: a round trip of 20 m, as in [F11]
/// - corridor: a round trip through corridors with many identical doors
/// - garden: outdoors, with hedges, trees, a house and a sky
[[nodiscard]] std::span<const std::string_view> scene_names();

/// Makes a built-in scene. Throws ContractError for an unknown name (the message lists the
/// known ones) or a variation out of range.
[[nodiscard]] Scene make_scene(std::string_view name, const SceneVariation& variation = {});

}  // namespace panonav::simulation
