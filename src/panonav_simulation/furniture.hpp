#pragma once

#include <string>

#include "panonav_simulation/scene_builder.hpp"

namespace panonav::simulation {

// Furniture used by several built-in scenes. Each piece draws its appearance from the builder's
// random engine.

/// Adds floor, ceiling and four plain walls around `room`, visible from inside, with pictures, a
/// door and windows.
void furnish_room_shell(SceneBuilder& builder, const FloorArea& room, double height_m);

/// Adds a desk of 1.4 x 0.7 m with drawers, a screen and papers on it.
void add_desk(SceneBuilder& builder, const std::string& name, const Footing& footing);
/// Adds an office chair on five legs, with its back along +y of the footing.
void add_chair(SceneBuilder& builder, const std::string& name, const Footing& footing);
/// Adds a bookshelf 0.32 m deep with books on both long sides.
void add_shelf(SceneBuilder& builder, const std::string& name, const Footing& footing,
               double width_m, double height_m);
/// Adds a wide, closed wardrobe of one tone, which is a large dark or bright part of a view.
void add_wardrobe(SceneBuilder& builder, const std::string& name, const Footing& footing,
                  double width_m, double height_m);
/// Adds a chest of drawers, 0.45 to 0.9 m wide, with an object on it.
void add_cabinet(SceneBuilder& builder, const std::string& name, const Footing& footing);
/// Adds a pot with leaves, about 1 m high.
void add_plant(SceneBuilder& builder, const std::string& name, Point2 centre);
/// Adds a box of any size, made of wood or with a picture on its sides.
void add_crate(SceneBuilder& builder, const std::string& name, const Footing& footing,
               Vector3 size);

/// Materials of one kind of tree.
struct TreeKind {
  int bark = 0;    ///< number of its material in the scene
  int leaves = 0;  ///< number of its material in the scene
};
/// Adds the materials of a new kind of tree to the scene; all trees of this kind share them.
[[nodiscard]] TreeKind make_tree_kind(SceneBuilder& builder);
/// Adds a trunk of 0.3 of the height below a crown of four to six clumps of leaves.
void add_tree(SceneBuilder& builder, const std::string& name, const TreeKind& kind, Point2 centre,
              double height_m);

}  // namespace panonav::simulation
