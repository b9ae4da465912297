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

/// Finds the free space of a scene that was read from a file. If the ground is not level, the robot
/// follows it: `scene.ground` is set, and `options.floor_height_m` to the middle of its heights; a
/// line in `scene.warnings` states the largest slope. Otherwise sets that height to the one with
/// the largest free area, of those up to half the robot's height above the lowest one. Enlarges
/// `options.cell_m` for floors of more than 4 million cells. Without room within `floor_low ..
/// floor_high`, extends this area by half its size (2 .. 10 m), where the ground continues. Tops of
/// things and, after them, positions inside of a solid are the last choice. Throws as FreeSpace.
[[nodiscard]] FreeSpace find_free_space(Scene& scene, FreeSpaceOptions& options,
                                        const FloorKnowledge& known);

}  // namespace panonav::simulation
