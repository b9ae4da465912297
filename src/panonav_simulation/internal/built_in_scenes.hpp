#pragma once

#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

// Functions used by `make_scene`, one per built-in scene.
[[nodiscard]] Scene make_office(const SceneVariation& variation);
[[nodiscard]] Scene make_lab(const SceneVariation& variation);
[[nodiscard]] Scene make_hall(const SceneVariation& variation, bool periodic);
[[nodiscard]] Scene make_arena(const SceneVariation& variation);
[[nodiscard]] Scene make_loop(const SceneVariation& variation);
[[nodiscard]] Scene make_corridor(const SceneVariation& variation);
[[nodiscard]] Scene make_garden(const SceneVariation& variation);
[[nodiscard]] Scene make_street(const SceneVariation& variation);
[[nodiscard]] Scene make_industrial_hall(const SceneVariation& variation);

}  // namespace panonav::simulation
