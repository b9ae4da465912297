#include "panonav_simulation/free_space.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav_simulation/internal/occupancy.hpp"
#include "panonav_simulation/internal/solids.hpp"

namespace panonav::simulation {

namespace {

struct Neighbour {
  int di;
  int dj;
  float length;
};
constexpr auto diagonal = std::numbers::sqrt2_v<float>;
constexpr std::array<Neighbour, 8> neighbours{{{1, 0, 1.0F},
                                               {-1, 0, 1.0F},
                                               {0, 1, 1.0F},
                                               {0, -1, 1.0F},
                                               {1, 1, diagonal},
                                               {1, -1, diagonal},
                                               {-1, 1, diagonal},
                                               {-1, -1, diagonal}}};

bool is_drivable(const Scene& scene, Point2 p) {
  return scene.drivable.empty() ||
         std::any_of(scene.drivable.begin(), scene.drivable.end(), [p](const FloorArea& area) {
           return p.x_m >= area.low.x_m && p.x_m <= area.high.x_m && p.y_m >= area.low.y_m &&
                  p.y_m <= area.high.y_m;
         });
}

std::string format_point(Point2 p) {
  return "(" + to_text(p.x_m) + ", " + to_text(p.y_m) + ")";
}

// Returns 1 for the cells of the raster with a surface between step and robot height.
std::vector<std::uint8_t> find_obstacles(const Scene& scene, const Raster& raster,
                                         const FreeSpaceOptions& options) {
  if (scene.ground != nullptr) {
    return find_cells_above_ground(scene, raster, *scene.ground, options.step_height_m,
                                   options.robot_height_m);
  }
  const double z = options.floor_height_m;
  return find_occupied_cells(scene, raster, z + options.step_height_m, z + options.robot_height_m);
}

// Returns 1 for the cells of the raster with ground at their centre.
std::vector<std::uint8_t> find_ground_cells(const Ground& ground, const Raster& raster) {
  std::vector<std::uint8_t> cells;
  for (int j = 0; j < raster.rows; ++j) {
    for (int i = 0; i < raster.columns; ++i) {
      cells.push_back(ground.plane_at({raster.low.x_m + (i + 0.5) * raster.cell_m,
                                       raster.low.y_m + (j + 0.5) * raster.cell_m})
                              .is_ground
                          ? 1
                          : 0);
    }
  }
  return cells;
}

}  // namespace

FreeSpaceOptions free_space_options(double robot_radius_m, double camera_height_m) {
  return {.robot_radius_m = robot_radius_m,
          .robot_height_m = camera_height_m,
          .step_height_m = camera_height_m / 12.0,
          .cell_m = robot_radius_m / 8.0};
}

FreeSpaceOptions free_space_options(const Scene& scene) {
  return free_space_options(scene.robot_radius_m, scene.camera_height_m);
}

void visit_options(FreeSpaceOptions& options, OptionVisitor& visitor) {
  using T = FreeSpaceOptions;
  constexpr OptionTable table{
      option<&T::robot_radius_m>("radius of the robot", 0, 10),
      option<&T::robot_height_m>("height of the robot; objects below this height are obstacles",
                                 above(0), 100),
      option<&T::step_height_m>("largest height of objects that the robot can drive over", 0, 10),
      option<&T::floor_height_m>("height of the floor in the scene"),
      option<&T::cell_m>("cell size of the map of free space", 0.001, 1),
  };
  table.visit(options, visitor);
}

FreeSpace::FreeSpace(const Scene& scene, const FreeSpaceOptions& options,
                     std::optional<Point2> seed)
    : low_(scene.floor_low),
      high_(scene.floor_high),
      cell_m_(options.cell_m),
      robot_radius_m_(options.robot_radius_m) {
  validate(options);
  validate(scene);
  require(options.step_height_m < options.robot_height_m, "step_height_m", options.step_height_m,
          "less than robot_height_m, " + to_text(options.robot_height_m));
  const auto count = [this](const char* field, double extent) {
    require(extent > 0.0 && extent / cell_m_ <= 1e5, field, extent, "> 0 and at most 100000 cells");
    return static_cast<int>(std::ceil(extent / cell_m_ - 1e-9));
  };
  columns_ = count("extent of the floor in x", high_.x_m - low_.x_m);
  rows_ = count("extent of the floor in y", high_.y_m - low_.y_m);
  require(static_cast<double>(columns_) * rows_ <= 1e8, "cells of the floor",
          static_cast<double>(columns_) * rows_, "<= 100000000; use larger cells");

  // Obstacles just outside the floor's rectangle also limit the clearance, so the raster has a
  // margin.
  const int margin = static_cast<int>(std::ceil(options.robot_radius_m / cell_m_)) + 2;
  const Raster raster{{low_.x_m - margin * cell_m_, low_.y_m - margin * cell_m_},
                      cell_m_,
                      columns_ + 2 * margin,
                      rows_ + 2 * margin};
  const auto raster_index = [&](Cell cell) {
    return static_cast<std::size_t>(cell.j + margin) * static_cast<std::size_t>(raster.columns) +
           static_cast<std::size_t>(cell.i + margin);
  };
  const double z = options.floor_height_m;
  const Ground* const ground = scene.ground.get();
  const auto obstacles = find_obstacles(scene, raster, options);
  const auto floor = ground != nullptr
                         ? find_ground_cells(*ground, raster)
                         : find_occupied_cells(scene, raster, z - options.step_height_m,
                                               z + options.step_height_m);
  const bool has_floor = std::find(floor.begin(), floor.end(), 1) != floor.end();
  const auto distances = compute_distances_to_cells(obstacles, raster);

  const std::size_t cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  obstacle_.resize(cells);
  free_.resize(cells);
  clearance_m_.resize(cells);
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const Cell cell{i, j};
      const std::size_t k = index(cell);
      obstacle_[k] = obstacles[raster_index(cell)];
      // Cell centres overestimate the distance between any points of the two cells by up to half a
      // diagonal at each end.
      const double clearance =
          cell_m_ * (static_cast<double>(distances[raster_index(cell)]) - std::numbers::sqrt2);
      clearance_m_[k] = static_cast<float>(std::max(0.0, clearance));
      free_[k] = clearance >= options.robot_radius_m && obstacle_[k] == 0 &&
                 (!has_floor || floor[raster_index(cell)] != 0) && is_drivable(scene, centre(cell));
    }
  }
  keep_connected_component(
      scene, (ground != nullptr ? 0.0 : z) + 0.5 * (options.step_height_m + options.robot_height_m),
      seed);
  for (const std::uint32_t k : free_cells_) {
    if (ground == nullptr) break;
    const auto columns = static_cast<std::uint32_t>(columns_);
    const Ground::Plane plane =
        ground->plane_at(centre({static_cast<int>(k % columns), static_cast<int>(k / columns)}));
    max_slope_rad_ = std::max(
        max_slope_rad_, static_cast<double>(std::atan(std::hypot(plane.slope_x, plane.slope_y))));
  }
}

std::vector<std::vector<std::uint32_t>> FreeSpace::find_connected_components() const {
  std::vector<std::uint8_t> is_found(free_.size(), 0);
  std::vector<std::vector<std::uint32_t>> components;
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      if (free_[index({i, j})] == 0 || is_found[index({i, j})] != 0) continue;
      auto& component = components.emplace_back();
      const auto add = [&](Cell cell) {
        if (cell.i < 0 || cell.j < 0 || cell.i >= columns_ || cell.j >= rows_) return;
        if (free_[index(cell)] == 0 || is_found[index(cell)] != 0) return;
        is_found[index(cell)] = 1;
        component.push_back(static_cast<std::uint32_t>(index(cell)));
      };
      add({i, j});
      for (std::size_t next = 0; next < component.size(); ++next) {
        const int k = static_cast<int>(component[next]);
        // Connect cells across edges only, because a robot cannot pass diagonally between two
        // obstacles.
        for (std::size_t n = 0; n < 4; ++n)
          add({k % columns_ + neighbours[n].di, k / columns_ + neighbours[n].dj});
      }
    }
  }
  return components;
}

// Keeps one component; `z_m` is the height of the robot's middle in the scene, above the ground if
// there is one.
void FreeSpace::keep_connected_component(const Scene& scene, double z_m,
                                         std::optional<Point2> seed) {
  auto components = find_connected_components();
  // No surface within the robot's height separates the cells of a component, so that the same
  // solids are around all of them, except near gaps of surfaces: the median of some cells counts.
  const auto count_solids = [&](const Solids& solids, const std::vector<std::uint32_t>& component) {
    std::array<std::size_t, 5> counts{};
    for (std::size_t n = 0; n < counts.size(); ++n) {
      const std::size_t probe = (2 * n + 1) * component.size() / (2 * counts.size());
      const int k = static_cast<int>(component[probe]);
      const Point2 at = centre({k % columns_, k / columns_});
      const double ground_m = scene.ground != nullptr ? scene.ground->height_m(at) : 0.0;
      counts[n] = solids.count_around({at.x_m, at.y_m, ground_m + z_m});
    }
    std::ranges::sort(counts);
    return counts[counts.size() / 2];
  };
  if (seed) {
    const auto cell = cell_at(*seed);
    std::erase_if(components, [&](const std::vector<std::uint32_t>& component) {
      return !cell || std::ranges::find(component, static_cast<std::uint32_t>(index(*cell))) ==
                          component.end();
    });
    if (components.empty())
      throw ContractError("seed of the free space", format_point(*seed),
                          "a place where the robot can stand");
  } else if (components.empty()) {
    throw ContractError(
        "free places between " + format_point(low_) + " and " + format_point(high_), 0.0,
        ">= 1; the robot stands nowhere: set --floor-height-m to the height of the floor, or a "
        "smaller --cell-m or --robot-radius-m");
  }
  std::ranges::stable_sort(components,
                           [](const auto& a, const auto& b) { return a.size() > b.size(); });
  // Smaller components are corners between obstacles.
  constexpr std::size_t max_components = 50;
  components.resize(std::min(components.size(), max_components));
  const Solids solids(scene);
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  std::size_t kept = 0;
  for (std::size_t c = 0; c < components.size() && fewest > 0; ++c) {
    const std::size_t count = count_solids(solids, components[c]);
    if (count < fewest) kept = c;
    fewest = std::min(fewest, count);
  }
  is_inside_solid_ = fewest > 0;
  std::ranges::fill(free_, std::uint8_t{0});
  free_cells_ = std::move(components[kept]);
  std::ranges::sort(free_cells_);
  for (const std::uint32_t k : free_cells_) free_[k] = 1;
}

std::optional<FreeSpace::Cell> FreeSpace::cell_at(Point2 position) const noexcept {
  const double i = std::floor((position.x_m - low_.x_m) / cell_m_);
  const double j = std::floor((position.y_m - low_.y_m) / cell_m_);
  if (!(i >= 0.0 && i < columns_ && j >= 0.0 && j < rows_)) return std::nullopt;
  return Cell{static_cast<int>(i), static_cast<int>(j)};
}

Point2 FreeSpace::centre(Cell cell) const noexcept {
  return {low_.x_m + (cell.i + 0.5) * cell_m_, low_.y_m + (cell.j + 0.5) * cell_m_};
}

bool FreeSpace::is_free(Point2 position) const noexcept {
  const auto cell = cell_at(position);
  return cell && free_[index(*cell)] != 0;
}

double FreeSpace::clearance_m(Point2 position) const noexcept {
  const auto cell = cell_at(position);
  return cell ? clearance_m_[index(*cell)] : 0.0;
}

bool FreeSpace::is_free_between(Point2 a, Point2 b) const noexcept {
  // Visit every cell on the segment, ordered by the parameters at which it crosses cell borders.
  if (!is_free(a) || !is_free(b)) return false;
  Cell cell = *cell_at(a);
  const Cell end = *cell_at(b);
  const double dx = b.x_m - a.x_m;
  const double dy = b.y_m - a.y_m;
  constexpr double never = std::numeric_limits<double>::infinity();
  const auto next_crossing = [this](double start, double low, int cell_number, double d) {
    if (d == 0.0) return never;
    return (low + (cell_number + (d > 0.0 ? 1 : 0)) * cell_m_ - start) / d;
  };
  const int steps = std::abs(end.i - cell.i) + std::abs(end.j - cell.j);
  for (int step = 0; step < steps; ++step) {
    const double tx = cell.i == end.i ? never : next_crossing(a.x_m, low_.x_m, cell.i, dx);
    const double ty = cell.j == end.j ? never : next_crossing(a.y_m, low_.y_m, cell.j, dy);
    if (tx <= ty) {
      cell.i += dx > 0.0 ? 1 : -1;
    } else {
      cell.j += dy > 0.0 ? 1 : -1;
    }
    if (free_[index(cell)] == 0) return false;
  }
  return true;
}

double FreeSpace::area_m2() const noexcept {
  return static_cast<double>(free_cells_.size()) * cell_m_ * cell_m_;
}

std::vector<GridPosition> FreeSpace::grid(double spacing_m, GridOrder order) const {
  std::vector<GridPosition> places = grid_positions(low_, high_, spacing_m, order);
  std::erase_if(places, [this](const GridPosition& place) { return !is_free(place.position); });
  return places;
}

Pose2 FreeSpace::random_pose(Random& random) const {
  const std::uint32_t k = free_cells_[random.index(free_cells_.size())];
  const auto columns = static_cast<std::uint32_t>(columns_);
  const Point2 middle = centre({static_cast<int>(k % columns), static_cast<int>(k / columns)});
  const double half = 0.5 * cell_m_;
  Pose2 pose;
  pose.x_m = middle.x_m + random.uniform(-half, half);
  pose.y_m = middle.y_m + random.uniform(-half, half);
  pose.heading_rad = wrap_angle(random.uniform(-std::numbers::pi, std::numbers::pi));
  // Rounding may move a point at the edge of a cell into the next one.
  if (!is_free(pose.position())) {
    pose.x_m = middle.x_m;
    pose.y_m = middle.y_m;
  }
  return pose;
}

std::optional<std::vector<Point2>> FreeSpace::shortest_path(Point2 a, Point2 b) const {
  if (!is_free(a) || !is_free(b)) return std::nullopt;
  const Cell start = *cell_at(a);
  const Cell goal = *cell_at(b);
  constexpr float unreached = std::numeric_limits<float>::infinity();
  std::vector<float> cost(free_.size(), unreached);
  std::vector<std::uint8_t> arrival_direction(free_.size(), 0);
  const auto estimate = [goal](Cell cell) {
    const auto di = static_cast<float>(std::abs(cell.i - goal.i));
    const auto dj = static_cast<float>(std::abs(cell.j - goal.j));
    return std::max(di, dj) + (diagonal - 1.0F) * std::min(di, dj);
  };
  struct Entry {
    float total;
    std::uint32_t cell;
    // Prefers the lower cell index among equal costs, so that the path is the same on every
    // machine.
    bool operator<(const Entry& other) const {
      return total != other.total ? total > other.total : cell > other.cell;
    }
  };
  std::priority_queue<Entry> open;
  cost[index(start)] = 0.0F;
  open.push({estimate(start), static_cast<std::uint32_t>(index(start))});
  std::vector<std::uint8_t> closed(free_.size(), 0);
  while (!open.empty() && closed[index(goal)] == 0) {
    const std::uint32_t k = open.top().cell;
    open.pop();
    if (closed[k] != 0) continue;
    closed[k] = 1;
    const Cell cell{static_cast<int>(k) % columns_, static_cast<int>(k) / columns_};
    for (std::uint8_t n = 0; n < neighbours.size(); ++n) {
      const Cell next{cell.i + neighbours[n].di, cell.j + neighbours[n].dj};
      if (next.i < 0 || next.j < 0 || next.i >= columns_ || next.j >= rows_) continue;
      if (free_[index(next)] == 0) continue;
      // A diagonal step requires both adjacent cells to be free.
      if (n >= 4 && (free_[index({next.i, cell.j})] == 0 || free_[index({cell.i, next.j})] == 0))
        continue;
      const float cost_through_cell = cost[k] + neighbours[n].length;
      if (!(cost_through_cell < cost[index(next)])) continue;
      cost[index(next)] = cost_through_cell;
      arrival_direction[index(next)] = n;
      open.push({cost_through_cell + estimate(next), static_cast<std::uint32_t>(index(next))});
    }
  }
  if (closed[index(goal)] == 0) return std::nullopt;

  std::vector<Point2> cells{b};
  for (Cell cell = goal; index(cell) != index(start);) {
    const Neighbour& step = neighbours[arrival_direction[index(cell)]];
    cell = {cell.i - step.di, cell.j - step.dj};
    cells.push_back(centre(cell));
  }
  cells.back() = a;
  std::reverse(cells.begin(), cells.end());
  if (cells.size() == 1) cells.push_back(b);
  return shorten_path(cells);
}

std::vector<Point2> FreeSpace::shorten_path(std::vector<Point2> path) const {
  // Connect each way point with the last one visible from it; then repeat from the other end with
  // added intermediate points, until the path becomes hardly shorter.
  constexpr int max_rounds = 20;
  constexpr double min_relative_gain = 1e-3;
  double length = path_length_m(path);
  for (int round = 0; round < max_rounds; ++round) {
    std::vector<Point2> tight{path.front()};
    for (std::size_t from = 0; from + 1 < path.size();) {
      std::size_t to = from + 1;
      while (to + 1 < path.size() && is_free_between(path[from], path[to + 1])) ++to;
      tight.push_back(path[to]);
      from = to;
    }
    const double before = std::exchange(length, path_length_m(tight));
    const bool done = round > 1 && length > (1.0 - min_relative_gain) * before;
    if (done && round % 2 == 0) return tight;
    path.clear();
    for (std::size_t i = 0; i < tight.size(); ++i) {
      if (i > 0) {
        const Point2 a = tight[i - 1];
        const Point2 b = tight[i];
        const int pieces = static_cast<int>(std::ceil(distance(a, b) / (2.0 * cell_m_)));
        for (int k = 1; k < pieces; ++k) {
          const double t = static_cast<double>(k) / pieces;
          path.push_back({a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m)});
        }
      }
      path.push_back(tight[i]);
    }
    std::reverse(path.begin(), path.end());
  }
  if (max_rounds % 2 == 1) std::reverse(path.begin(), path.end());
  return path;
}

Image FreeSpace::picture() const {
  Image image(columns_, rows_);
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const std::size_t k = index({i, j});
      const bool near = clearance_m_[k] < 1.0F && obstacle_[k] == 0;
      image.at(i, rows_ - 1 - j) = free_[k] != 0 ? 255 : obstacle_[k] != 0 ? 0 : near ? 160 : 80;
    }
  }
  return image;
}

}  // namespace panonav::simulation
