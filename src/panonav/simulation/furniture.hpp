#pragma once

#include <string>

#include "panonav/simulation/scene_builder.hpp"

namespace panonav {

// Pieces that the built-in scenes share. Each draws its looks from the builder's random engine.

/// Four plain walls around `room`, seen from inside, with pictures, a door and windows on them.
void furnish_room_shell(SceneBuilder& builder, const FloorArea& room, double height_m);

void add_desk(SceneBuilder& builder, const std::string& name, const Footing& footing);
void add_chair(SceneBuilder& builder, const std::string& name, const Footing& footing);
void add_shelf(SceneBuilder& builder, const std::string& name, const Footing& footing,
               double width_m, double height_m);
/// Wide, closed and of one tone: what makes the large dark and bright parts of a view.
void add_wardrobe(SceneBuilder& builder, const std::string& name, const Footing& footing,
                  double width_m, double height_m);
void add_cabinet(SceneBuilder& builder, const std::string& name, const Footing& footing);
void add_plant(SceneBuilder& builder, const std::string& name, Point2 centre);
void add_crate(SceneBuilder& builder, const std::string& name, const Footing& footing,
               Vector3 size);

/// Materials of a kind of tree.
struct TreeKind {
  int bark = 0;
  int leaves = 0;
};
[[nodiscard]] TreeKind make_tree_kind(SceneBuilder& builder);
void add_tree(SceneBuilder& builder, const std::string& name, const TreeKind& kind, Point2 centre,
              double height_m);

}  // namespace panonav
