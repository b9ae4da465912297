#include "panonav_simulation/internal/columns.hpp"

#include <array>
#include <limits>

#include "panonav_simulation/internal/solids.hpp"

namespace panonav::simulation {

namespace {

constexpr std::size_t min_share = 10;  // a ground covers at least this part of all columns

/// True if at least nine tenths of the heights are within a step of one height.
bool is_at_one_height(std::vector<float> heights, double step_m) {
  std::ranges::sort(heights);
  std::size_t max_count = 0;
  std::size_t begin = 0;
  for (std::size_t end = 0; end < heights.size(); ++end) {
    while (heights[end] > heights[begin] + 2.0 * step_m) ++begin;
    max_count = std::max(max_count, end + 1 - begin);
  }
  return 10 * max_count >= 9 * heights.size();
}

}  // namespace

Columns::Columns(const Scene& scene, bool may_be_room) {
  constexpr double min_cell_m = 0.1;
  constexpr double max_columns = 250000.0;
  const double width_m = scene.floor_high.x_m - scene.floor_low.x_m;
  const double depth_m = scene.floor_high.y_m - scene.floor_low.y_m;
  raster_.low = scene.floor_low;
  raster_.cell_m = std::max({min_cell_m, std::sqrt(width_m * depth_m / max_columns),
                             std::max(width_m, depth_m) / max_columns});
  raster_.columns = std::max(1, static_cast<int>(width_m / raster_.cell_m));
  raster_.rows = std::max(1, static_cast<int>(depth_m / raster_.cell_m));
  crossings_.resize(static_cast<std::size_t>(raster_.columns) *
                    static_cast<std::size_t>(raster_.rows));
  const Solids solids(scene);
  solids.for_each_triangle([&](const Solids::Triangle& triangle, std::size_t surface) {
    if (may_be_room && surface == is_room_.size())
      is_room_.push_back(solids.contains_everything(surface));
    const Mesh& mesh = scene.meshes[triangle[0]];
    const auto& t = mesh.triangles[triangle[1]];
    for_each_crossing(raster_, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
                      [&](std::size_t k, const TrianglePoint& point) {
                        crossings_[k].push_back(
                            {static_cast<float>(point.z_m), static_cast<std::uint32_t>(surface),
                             static_cast<float>(point.slope_x), static_cast<float>(point.slope_y),
                             point.is_level, point.faces_up});
                      });
  });
  for (auto& column : crossings_)
    std::ranges::stable_sort(column, {}, [](const Crossing& c) { return c.z; });
}

std::vector<double> Columns::find_standing_heights(const FreeSpaceOptions& robot) const {
  std::vector<const Crossing*> surfaces;
  for (const auto& column : crossings_)
    surfaces.push_back(find_standing_surface(column, robot.robot_height_m));
  const int reach = static_cast<int>(std::ceil(robot.robot_radius_m / raster_.cell_m));
  std::vector<double> wide;
  for (int j = 0; j < raster_.rows; ++j) {
    for (int i = 0; i < raster_.columns; ++i) {
      const Crossing* const surface = surfaces[index(i, j)];
      const auto is_as_high = [&](int di, int dj) {
        if (i + di < 0 || i + di >= raster_.columns || j + dj < 0 || j + dj >= raster_.rows)
          return false;
        const Crossing* const other = surfaces[index(i + di, j + dj)];
        return other != nullptr && std::abs(static_cast<double>(other->z) -
                                            static_cast<double>(surface->z)) <= robot.step_height_m;
      };
      if (surface != nullptr && is_as_high(reach, 0) && is_as_high(-reach, 0) &&
          is_as_high(0, reach) && is_as_high(0, -reach))
        wide.push_back(surface->z);
    }
  }
  return min_share * wide.size() < surfaces.size() ? std::vector<double>{} : wide;
}

// Returns the lowest surface outside of solids with room above it; null if there is none.
const Columns::Crossing* Columns::find_standing_surface(const std::vector<Crossing>& column,
                                                        double room_m) const {
  constexpr float same_m = 1e-3F;  // surfaces this near are one
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!column[i].is_level) continue;
    std::size_t next = i + 1;
    while (next < column.size() && column[next].z <= column[i].z + same_m) ++next;
    if (next == column.size()) return &column[i];
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
    if (!is_solid) return &column[i];
  }
  return nullptr;
}

// Returns the surface of the largest connected ground in each column; null in the other columns.
std::vector<const Columns::Crossing*> Columns::find_largest_ground(
    const FreeSpaceOptions& robot) const {
  std::vector<const Crossing*> surfaces;
  for (const auto& column : crossings_)
    surfaces.push_back(find_standing_surface(column, robot.robot_height_m));
  const auto is_connected = [&](const Crossing& a, const Crossing& b) {
    const double slope =
        std::max(std::hypot(a.slope_x, a.slope_y), std::hypot(b.slope_x, b.slope_y));
    return std::abs(a.z - b.z) <= robot.step_height_m + slope * raster_.cell_m;
  };
  std::vector<bool> is_found(surfaces.size(), false);
  std::vector<std::size_t> largest;
  for (std::size_t first = 0; first < surfaces.size(); ++first) {
    if (surfaces[first] == nullptr || is_found[first]) continue;
    is_found[first] = true;
    std::vector<std::size_t> part{first};
    for (std::size_t next = 0; next < part.size(); ++next) {
      const int i = static_cast<int>(part[next]) % raster_.columns;
      const int j = static_cast<int>(part[next]) / raster_.columns;
      constexpr std::array<std::array<int, 2>, 4> steps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
      for (const auto& [di, dj] : steps) {
        if (i + di < 0 || j + dj < 0 || i + di >= raster_.columns || j + dj >= raster_.rows)
          continue;
        const std::size_t k = index(i + di, j + dj);
        if (surfaces[k] == nullptr || is_found[k]) continue;
        if (!is_connected(*surfaces[part[next]], *surfaces[k])) continue;
        is_found[k] = true;
        part.push_back(k);
      }
    }
    if (part.size() > largest.size()) largest = std::move(part);
  }
  std::vector<const Crossing*> ground(surfaces.size(), nullptr);
  for (const std::size_t k : largest) ground[k] = surfaces[k];
  return ground;
}

std::shared_ptr<const Ground> Columns::find_sloping_ground(const Scene& scene,
                                                           const FreeSpaceOptions& robot,
                                                           double cell_m) const {
  const std::vector<const Crossing*> coarse = find_largest_ground(robot);
  std::vector<float> heights;
  for (const Crossing* const surface : coarse) {
    if (surface != nullptr) heights.push_back(surface->z);
  }
  if (heights.empty() || min_share * heights.size() < coarse.size()) return nullptr;
  if (is_at_one_height(heights, robot.step_height_m)) return nullptr;

  Raster fine{raster_.low, cell_m, 0, 0};
  fine.columns =
      static_cast<int>(std::ceil((scene.floor_high.x_m - scene.floor_low.x_m) / cell_m - 1e-9));
  fine.rows =
      static_cast<int>(std::ceil((scene.floor_high.y_m - scene.floor_low.y_m) / cell_m - 1e-9));
  std::vector<Ground::Plane> planes(static_cast<std::size_t>(fine.columns) *
                                    static_cast<std::size_t>(fine.rows));
  std::vector<float> differences_m(planes.size(), std::numeric_limits<float>::infinity());
  // Takes the surface next to the plane of the nearest column with ground, at most one column away.
  const auto consider = [&](std::size_t k, const TrianglePoint& point) {
    if (!point.is_level) return;
    const auto columns = static_cast<std::size_t>(fine.columns);
    const double x = (static_cast<double>(k % columns) + 0.5) * cell_m / raster_.cell_m;
    const double y = (static_cast<double>(k / columns) + 0.5) * cell_m / raster_.cell_m;
    const int ci = std::clamp(static_cast<int>(x), 0, raster_.columns - 1);
    const int cj = std::clamp(static_cast<int>(y), 0, raster_.rows - 1);
    double nearest = std::numeric_limits<double>::infinity();
    double difference_m = nearest;
    for (int j = std::max(0, cj - 1); j <= std::min(raster_.rows - 1, cj + 1); ++j) {
      for (int i = std::max(0, ci - 1); i <= std::min(raster_.columns - 1, ci + 1); ++i) {
        const Crossing* const surface = coarse[index(i, j)];
        const double distance = std::hypot(x - i - 0.5, y - j - 0.5);
        if (surface == nullptr || distance >= nearest) continue;
        nearest = distance;
        const double expected_m = surface->z + raster_.cell_m * (surface->slope_x * (x - i - 0.5) +
                                                                 surface->slope_y * (y - j - 0.5));
        difference_m = std::abs(point.z_m - expected_m);
      }
    }
    const double slope = std::hypot(point.slope_x, point.slope_y);
    if (difference_m > robot.step_height_m + slope * nearest * raster_.cell_m) return;
    if (difference_m >= static_cast<double>(differences_m[k])) return;
    differences_m[k] = static_cast<float>(difference_m);
    planes[k] = {static_cast<float>(point.z_m), static_cast<float>(point.slope_x),
                 static_cast<float>(point.slope_y), true};
  };
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& t : mesh.triangles)
      for_each_crossing(fine, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]],
                        consider);
  }
  if (std::ranges::none_of(planes, &Ground::Plane::is_ground)) return nullptr;
  return std::make_shared<const Ground>(fine.low, cell_m, fine.columns, fine.rows,
                                        std::move(planes));
}

}  // namespace panonav::simulation
