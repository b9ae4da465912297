#include "panonav_simulation/floor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/mesh_library.hpp"
#include "panonav_simulation/internal/shapes.hpp"
#include "panonav_simulation/internal/solids.hpp"

namespace panonav::simulation {

namespace {

// A point where a vertical line crosses a surface.
struct Crossing {
  float z = 0.0F;
  std::uint32_t surface = 0;  // number among the scene's Solids
  bool is_level = false;      // at most 30 degrees steep
  bool faces_up = false;
};

// Vertical lines on a raster, and where they cross the surfaces of a scene.
class Columns {
 public:
  Columns(const Scene& scene, bool may_be_room) : low_(scene.floor_low) {
    constexpr double min_cell_m = 0.1;
    constexpr double max_columns = 250000.0;
    const double width_m = scene.floor_high.x_m - low_.x_m;
    const double depth_m = scene.floor_high.y_m - low_.y_m;
    cell_m_ = std::max({min_cell_m, std::sqrt(width_m * depth_m / max_columns),
                        std::max(width_m, depth_m) / max_columns});
    columns_ = std::max(1, static_cast<int>(width_m / cell_m_));
    rows_ = std::max(1, static_cast<int>(depth_m / cell_m_));
    crossings_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    const Solids solids(scene);
    solids.for_each_triangle([&](const Solids::Triangle& triangle, std::size_t surface) {
      if (may_be_room && surface == is_room_.size())
        is_room_.push_back(solids.contains_everything(surface));
      const Mesh& mesh = scene.meshes[triangle[0]];
      const auto& t = mesh.triangles[triangle[1]];
      add(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
          static_cast<std::uint32_t>(surface));
    });
    for (auto& column : crossings_)
      std::ranges::stable_sort(column, {}, [](const Crossing& c) { return c.z; });
  }

  // Returns the heights of the lowest surfaces with room for the robot above them, of each column
  // whose neighbours at the robot's radius are as high: tops of walls are too narrow. Empty if
  // these are less than a tenth of all columns: tops of a few things without ground.
  [[nodiscard]] std::vector<double> find_standing_heights(const FreeSpaceOptions& robot) const {
    std::vector<std::optional<double>> heights;
    for (const auto& column : crossings_)
      heights.push_back(find_standing_height(column, robot.robot_height_m));
    const int reach = static_cast<int>(std::ceil(robot.robot_radius_m / cell_m_));
    std::vector<double> wide;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        const auto& height = heights[index(i, j)];
        const auto is_as_high = [&](int di, int dj) {
          if (i + di < 0 || i + di >= columns_ || j + dj < 0 || j + dj >= rows_) return false;
          const auto& other = heights[index(i + di, j + dj)];
          return other && std::abs(*other - *height) <= robot.step_height_m;
        };
        if (height && is_as_high(reach, 0) && is_as_high(-reach, 0) && is_as_high(0, reach) &&
            is_as_high(0, -reach))
          wide.push_back(*height);
      }
    }
    constexpr std::size_t min_share = 10;
    return min_share * wide.size() < heights.size() ? std::vector<double>{} : wide;
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(i);
  }

  void add(const Vector3& a, const Vector3& b, const Vector3& c, std::uint32_t surface) {
    const double ux = b.x_m - a.x_m;
    const double uy = b.y_m - a.y_m;
    const double vx = c.x_m - a.x_m;
    const double vy = c.y_m - a.y_m;
    const double normal_z = ux * vy - uy * vx;
    if (normal_z == 0.0) return;
    const double uz = b.z_m - a.z_m;
    const double vz = c.z_m - a.z_m;
    const double length = std::hypot(uy * vz - uz * vy, uz * vx - ux * vz, normal_z);
    constexpr double min_cosine = 0.866;  // 30 degrees
    const bool is_level = std::abs(normal_z) >= min_cosine * length;
    const auto [x_low, x_high] = std::minmax({a.x_m, b.x_m, c.x_m});
    const auto [y_low, y_high] = std::minmax({a.y_m, b.y_m, c.y_m});
    const int i_end = last_centre(x_high - low_.x_m, columns_);
    const int j_end = last_centre(y_high - low_.y_m, rows_);
    for (int j = first_centre(y_low - low_.y_m, rows_); j <= j_end; ++j) {
      for (int i = first_centre(x_low - low_.x_m, columns_); i <= i_end; ++i) {
        const double px = low_.x_m + (i + 0.5) * cell_m_ - a.x_m;
        const double py = low_.y_m + (j + 0.5) * cell_m_ - a.y_m;
        const double s = (px * vy - py * vx) / normal_z;
        const double t = (ux * py - uy * px) / normal_z;
        if (s < 0.0 || t < 0.0 || s + t > 1.0) continue;
        crossings_[index(i, j)].push_back(
            {static_cast<float>(a.z_m + s * uz + t * vz), surface, is_level, normal_z > 0.0});
      }
    }
  }

  [[nodiscard]] int first_centre(double from_m, int count) const {
    return static_cast<int>(std::clamp(std::ceil(from_m / cell_m_ - 0.5), 0.0, count + 0.0));
  }
  [[nodiscard]] int last_centre(double to_m, int count) const {
    return static_cast<int>(std::clamp(std::floor(to_m / cell_m_ - 0.5), -1.0, count - 1.0));
  }

  [[nodiscard]] std::optional<double> find_standing_height(const std::vector<Crossing>& column,
                                                           double room_m) const {
    constexpr float same_m = 1e-3F;  // surfaces this near are one
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (!column[i].is_level) continue;
      std::size_t next = i + 1;
      while (next < column.size() && column[next].z <= column[i].z + same_m) ++next;
      if (next == column.size()) return column[i].z;
      if (static_cast<double>(column[next].z - column[i].z) < room_m) continue;
      // Going up, a closed surface is entered where it faces down and left where it faces up.
      const auto is_entered = [&](const Crossing& above) {
        int entered = 0;
        for (std::size_t k = 0; k < next; ++k) {
          if (column[k].surface == above.surface) entered += column[k].faces_up ? -1 : 1;
        }
        const bool is_room = above.surface < is_room_.size() && is_room_[above.surface];
        return above.faces_up && entered > 0 && !is_room;
      };
      const bool is_solid =
          std::any_of(column.begin() + static_cast<std::ptrdiff_t>(next), column.end(), is_entered);
      if (!is_solid) return column[i].z;
    }
    return std::nullopt;
  }

  Point2 low_;
  double cell_m_ = 0.1;
  int columns_ = 1;
  int rows_ = 1;
  std::vector<std::vector<Crossing>> crossings_;
  std::vector<bool> is_room_;  // of each surface; empty: none is
};

double floor_area_m2(const Scene& scene) {
  return (scene.floor_high.x_m - scene.floor_low.x_m) *
         (scene.floor_high.y_m - scene.floor_low.y_m);
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
    if (!known_.is_cell_known) {
      constexpr double max_cells = 4e6;
      options.cell_m = std::max({options.cell_m, std::sqrt(floor_area_m2(scene) / max_cells),
                                 (scene.floor_high.x_m - scene.floor_low.x_m) / 1e5,
                                 (scene.floor_high.y_m - scene.floor_low.y_m) / 1e5});
    }
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

}  // namespace

std::vector<double> find_floor_heights(const Scene& scene, const FreeSpaceOptions& options,
                                       bool may_be_room) {
  const Columns columns(scene, may_be_room);
  std::vector<double> heights = columns.find_standing_heights(options);
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

FreeSpace find_free_space(Scene& scene, FreeSpaceOptions& options, const FloorKnowledge& known) {
  validate(options);
  validate(scene);
  Scene extended = scene;
  extend_floor(extended);
  const auto find_heights = [&](const Scene& in) {
    return known.is_height_known ? std::vector{options.floor_height_m}
                                 : find_floor_heights(in, options, known.may_be_room);
  };
  std::vector<double> extended_heights = find_heights(extended);
  const double ground_m = known.is_height_known ? options.floor_height_m : extent(scene)->first.z_m;
  if (extended_heights.empty()) {
    add_ground(extended, ground_m);
    extended_heights = {ground_m};
  }
  Scene within = extended;
  within.floor_low = scene.floor_low;
  within.floor_high = scene.floor_high;
  std::vector<double> heights = find_heights(within);
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
  FloorSearch::Floor best = search.take_best();
  options = best.options;
  scene.floor_low = best.low;
  scene.floor_high = best.high;
  return std::move(best.space);
}

}  // namespace panonav::simulation
