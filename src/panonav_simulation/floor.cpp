#include "panonav_simulation/floor.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav_simulation/internal/columns.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/shapes.hpp"

namespace panonav::simulation {

namespace {

double floor_area_m2(const Scene& scene) {
  return (scene.floor_high.x_m - scene.floor_low.x_m) *
         (scene.floor_high.y_m - scene.floor_low.y_m);
}

// Returns the cell size of the map of free space: the set one, or a larger one for large floors.
double choose_cell_m(const Scene& scene, const FreeSpaceOptions& options,
                     const FloorKnowledge& known) {
  constexpr double max_cells = 4e6;
  if (known.is_cell_known) return options.cell_m;
  return std::max({options.cell_m, std::sqrt(floor_area_m2(scene) / max_cells),
                   (scene.floor_high.x_m - scene.floor_low.x_m) / 1e5,
                   (scene.floor_high.y_m - scene.floor_low.y_m) / 1e5});
}

// Tries floors of one scene and keeps the best.
class FloorSearch {
 public:
  FloorSearch(const FreeSpaceOptions& options, const FloorKnowledge& known)
      : options_(options), known_(known) {}

  struct Floor {
    FreeSpaceOptions options;
    FreeSpace space;
    Point2 low;
    Point2 high;
  };

  // Keeps a floor if it is outside of solids or the first one inside, and larger than the best one.
  void try_floor(const Scene& scene, double height_m) {
    FreeSpaceOptions options = options_;
    options.floor_height_m = height_m;
    options.cell_m = choose_cell_m(scene, options, known_);
    try {
      Floor floor{options, FreeSpace(scene, options), scene.floor_low, scene.floor_high};
      auto& best = floor.space.is_inside_solid() && !known_.may_be_room ? inside_ : outside_;
      if (!best || floor.space.area_m2() > best->space.area_m2()) best = std::move(floor);
    } catch (const ContractError& error) {
      if (!error_) error_ = error;
    }
  }

  // True if the best floor outside of solids has room for eight robots beside each other.
  [[nodiscard]] bool has_room() const {
    const double robot_m2 = std::numbers::pi * options_.robot_radius_m * options_.robot_radius_m;
    return outside_ && outside_->space.area_m2() >= 8.0 * robot_m2;
  }
  [[nodiscard]] bool has_floor_outside() const { return outside_.has_value(); }

  // Returns the best floor. Throws the first error if there is none.
  [[nodiscard]] Floor take_best() {
    if (outside_) return std::move(*outside_);
    if (inside_) return std::move(*inside_);
    throw error_.value();
  }

 private:
  FreeSpaceOptions options_;
  FloorKnowledge known_;
  std::optional<Floor> outside_;
  std::optional<Floor> inside_;
  std::optional<ContractError> error_;
};

void extend_floor(Scene& scene) {
  const double size_m = std::max(scene.floor_high.x_m - scene.floor_low.x_m,
                                 scene.floor_high.y_m - scene.floor_low.y_m);
  const double margin_m = std::clamp(0.5 * size_m, 2.0, 10.0);
  scene.floor_low = {scene.floor_low.x_m - margin_m, scene.floor_low.y_m - margin_m};
  scene.floor_high = {scene.floor_high.x_m + margin_m, scene.floor_high.y_m + margin_m};
}

// Adds a level ground everywhere on the scene's floor area.
void add_ground(Scene& scene, double height_m) {
  Affine3 place;
  place.translation = {0.5 * (scene.floor_low.x_m + scene.floor_high.x_m),
                       0.5 * (scene.floor_low.y_m + scene.floor_high.y_m), height_m};
  place_mesh(scene,
             make_rectangle_mesh(scene.floor_high.x_m - scene.floor_low.x_m,
                                 scene.floor_high.y_m - scene.floor_low.y_m),
             place, "ground", 0);
}

// Returns up to three of the heights, see the header.
std::vector<double> select_floor_heights(std::vector<double> heights,
                                         const FreeSpaceOptions& options) {
  std::ranges::sort(heights);
  const std::size_t total = heights.size();
  std::vector<double> result;
  constexpr std::size_t max_heights = 3;
  constexpr double min_share = 0.02;  // of all columns; smaller ones are tops of things
  while (result.size() < max_heights && !heights.empty()) {
    // Find the most columns within one step, and their middle height.
    std::size_t first = 0;
    std::size_t max_count = 0;
    std::size_t begin = 0;
    for (std::size_t end = 0; end < heights.size(); ++end) {
      while (heights[end] > heights[begin] + options.step_height_m) ++begin;
      if (end + 1 - begin > max_count) {
        max_count = end + 1 - begin;
        first = begin;
      }
    }
    if (!result.empty() && static_cast<double>(max_count) < min_share * static_cast<double>(total))
      break;
    result.push_back(heights[first + max_count / 2]);
    const double found = result.back();
    std::erase_if(heights,
                  [&](double height) { return std::abs(height - found) <= options.step_height_m; });
  }
  return result;
}

// Finds the floor on a ground that is not level, within the area of `scene` or, without room there,
// of `extended`. Sets the ground of `scene` and adds a warning; nullopt if the ground is level, the
// height of the floor is set, or the robot can stand nowhere.
std::optional<FloorSearch::Floor> find_sloping_floor(Scene& scene, const Scene& extended,
                                                     const Columns& columns,
                                                     const FreeSpaceOptions& options,
                                                     const FloorKnowledge& known) {
  Scene sloping = extended;
  sloping.ground =
      columns.find_sloping_ground(extended, options, choose_cell_m(extended, options, known));
  if (sloping.ground == nullptr) return std::nullopt;
  if (known.is_height_known) {
    scene.warnings.push_back("the ground slopes, but the robot stays at the set floor height " +
                             to_text(options.floor_height_m) + " m");
    return std::nullopt;
  }
  const double middle_m = 0.5 * (sloping.ground->lowest_m() + sloping.ground->highest_m());
  FloorSearch search(options, known);
  Scene within = sloping;
  within.floor_low = scene.floor_low;
  within.floor_high = scene.floor_high;
  search.try_floor(within, middle_m);
  if (!search.has_room()) search.try_floor(sloping, middle_m);
  if (!search.has_floor_outside()) return std::nullopt;
  FloorSearch::Floor floor = search.take_best();
  scene.ground = std::move(sloping.ground);
  if (const auto slope_deg = std::lround(degrees(floor.space.max_slope_rad())); slope_deg > 0) {
    scene.warnings.push_back("the ground slopes by up to " + std::to_string(slope_deg) +
                             " degrees; the camera follows its height but stays upright, where a "
                             "real robot would tilt");
  }
  return floor;
}

// Finds the floor at one height.
FloorSearch::Floor find_level_floor(const Scene& scene, Scene extended, const Columns& columns,
                                    const FreeSpaceOptions& options, const FloorKnowledge& known) {
  std::vector<double> extended_heights =
      known.is_height_known ? std::vector{options.floor_height_m}
                            : select_floor_heights(columns.find_standing_heights(options), options);
  const double ground_m = known.is_height_known ? options.floor_height_m : extent(scene)->first.z_m;
  if (extended_heights.empty()) {
    add_ground(extended, ground_m);
    extended_heights = {ground_m};
  }
  Scene within = extended;
  within.floor_low = scene.floor_low;
  within.floor_high = scene.floor_high;
  std::vector<double> heights = known.is_height_known
                                    ? extended_heights
                                    : find_floor_heights(within, options, known.may_be_room);
  if (heights.empty()) heights = extended_heights;
  const double highest_m =
      *std::ranges::min_element(extended_heights) + 0.5 * options.robot_height_m;
  const auto is_top_of_thing = [&](double height_m) { return height_m > highest_m; };
  FloorSearch search(options, known);
  for (const bool tops : {false, true}) {
    for (const double height_m : heights) {
      if (is_top_of_thing(height_m) == tops) search.try_floor(within, height_m);
    }
    if (search.has_room()) break;
    for (const double height_m : extended_heights) {
      if (is_top_of_thing(height_m) == tops) search.try_floor(extended, height_m);
    }
    if (search.has_floor_outside()) break;
  }
  if (!search.has_floor_outside()) {
    add_ground(extended, ground_m);
    search.try_floor(extended, ground_m);
  }
  return search.take_best();
}

}  // namespace

std::vector<double> find_floor_heights(const Scene& scene, const FreeSpaceOptions& options,
                                       bool may_be_room) {
  return select_floor_heights(Columns(scene, may_be_room).find_standing_heights(options), options);
}

FreeSpace find_free_space(Scene& scene, FreeSpaceOptions& options, const FloorKnowledge& known) {
  validate(options);
  validate(scene);
  Scene extended = scene;
  extend_floor(extended);
  const Columns columns(extended, known.may_be_room);
  auto floor = find_sloping_floor(scene, extended, columns, options, known);
  if (!floor) floor = find_level_floor(scene, std::move(extended), columns, options, known);
  options = floor->options;
  scene.floor_low = floor->low;
  scene.floor_high = floor->high;
  return std::move(floor->space);
}

}  // namespace panonav::simulation
