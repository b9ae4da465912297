#pragma once

#include <vector>

#include "panonav_simulation/free_space.hpp"

namespace panonav::simulation {

/// Prior knowledge of the floor of a scene that was read from a file.
struct FloorKnowledge {
  bool is_height_known = false;  ///< true: `FreeSpaceOptions::floor_height_m` is the floor's
  bool is_cell_known = false;    ///< true: `FreeSpaceOptions::cell_m` is used for any size
  bool may_be_room = false;      ///< true: a closed surface around everything is a room, no solid
};

/// Returns up to three heights at which a robot may stand on the scene's floor area, the most
/// frequent one first: those of the lowest surfaces outside of solids, at most 30 degrees steep,
/// with room for the robot above them. Empty if there are none. Measured on at most 250,000
/// columns.
[[nodiscard]] std::vector<double> find_floor_heights(const Scene& scene,
                                                     const FreeSpaceOptions& options,
                                                     bool may_be_room = false);

/// Finds the free space of a scene that was read from a file. Sets `options.floor_height_m` to the
/// height with the largest free area, of those up to half the robot's height above the lowest one,
/// since higher ones are tops of things; enlarges `options.cell_m` for floors of more than 4
/// million cells. If there is no room within `floor_low .. floor_high`, this area is extended by
/// half its size (2 .. 10 m), where the ground continues, or everywhere if the scene has no ground.
/// Tops of things and, after them, positions inside of a solid are the last choice. Throws as
/// FreeSpace.
[[nodiscard]] FreeSpace find_free_space(Scene& scene, FreeSpaceOptions& options,
                                        const FloorKnowledge& known);

}  // namespace panonav::simulation
