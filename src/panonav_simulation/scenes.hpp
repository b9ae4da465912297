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
/// - office: 5 x 2 m of free floor amid desks and shelves [M04] [M03]
/// - hall: 7 x 7 m of free floor, things along the walls
/// - hall_periodic: the same with pillars and pictures every 2 m
/// - arena: 1.4 x 1.2 m of table with toy houses [S06]
/// - lab: a 7 x 5 m room [Y03] [S06]
/// - loop: a round trip of 20 m [F11]
/// - corridor: a round trip past many identical doors
/// - garden: hedges, trees, a house and a sky
/// - street: 620 m of houses, trees and parked cars
/// - industrial_hall: 104 x 62 m of aisles around racks, machines and crates
[[nodiscard]] std::span<const std::string_view> scene_names();

/// Makes a built-in scene. Throws ContractError for an unknown name (the message lists the
/// known ones) or a variation out of range.
[[nodiscard]] Scene make_scene(std::string_view name, const SceneVariation& variation = {});

}  // namespace panonav::simulation
