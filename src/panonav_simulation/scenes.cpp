#include "panonav_simulation/scenes.hpp"

#include <array>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/built_in_scenes.hpp"

namespace panonav::simulation {

namespace {

constexpr std::array<std::string_view, 10> built_in_names{
    "office", "hall",     "hall_periodic", "arena",  "lab",
    "loop",   "corridor", "garden",        "street", "industrial_hall"};

}  // namespace

std::span<const std::string_view> scene_names() {
  return built_in_names;
}

Scene make_scene(std::string_view name, const SceneVariation& variation) {
  require(variation.moved_objects >= 0.0 && variation.moved_objects <= 1.0, "moved_objects",
          variation.moved_objects, "0 .. 1");
  require(variation.light > 0.0 && variation.light <= 100.0, "light", variation.light,
          "> 0 and <= 100");
  if (name == "office") return make_office(variation);
  if (name == "hall") return make_hall(variation, false);
  if (name == "hall_periodic") return make_hall(variation, true);
  if (name == "lab") return make_lab(variation);
  if (name == "arena") return make_arena(variation);
  if (name == "loop") return make_loop(variation);
  if (name == "corridor") return make_corridor(variation);
  if (name == "garden") return make_garden(variation);
  if (name == "street") return make_street(variation);
  if (name == "industrial_hall") return make_industrial_hall(variation);
  std::string known;
  for (const auto& each : built_in_names) known += (known.empty() ? "" : ", ") + std::string(each);
  throw ContractError("scene", name, known);
}

}  // namespace panonav::simulation
