#include "lab/m04/lattice_support.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/m04/support.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/nearest_points.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_simulation/furniture.hpp"
#include "panonav_simulation/recording.hpp"

namespace panonav::lab {

namespace {

/// Column and row of a view in the grid.
struct GridCell {
  int i = 0;
  int j = 0;
};

GridCell locate_in_grid(const ViewGrid& grid, std::size_t view) {
  const int j = static_cast<int>(view) / grid.columns;
  const int along = static_cast<int>(view) % grid.columns;
  return {j % 2 == 0 ? along : grid.columns - 1 - along, j};
}

std::size_t view_index(const ViewGrid& grid, GridCell place) {
  const int along = place.j % 2 == 0 ? place.i : grid.columns - 1 - place.i;
  return static_cast<std::size_t>(place.j * grid.columns + along);
}

bool is_inner(const ViewGrid& grid, GridCell place) {
  return place.i > 0 && place.j > 0 && place.i < grid.columns - 1 && place.j < grid.rows - 1;
}

/// Replaces the scale of the alignment by the one that makes both sets equally large. The
/// least-squares scale would shrink a set that fits badly.
Alignment match_extent(std::span<const Point2> truth, std::span<const Point2> arranged,
                       Alignment alignment) {
  const auto centre = [](std::span<const Point2> points) {
    Point2 sum;
    for (const Point2 p : points) sum = {sum.x_m + p.x_m, sum.y_m + p.y_m};
    const auto n = static_cast<double>(points.size());
    return Point2{sum.x_m / n, sum.y_m / n};
  };
  const auto extent = [&](std::span<const Point2> points) {
    double sum = 0.0;
    for (const Point2 p : points) sum += std::pow(distance(p, centre(points)), 2);
    return std::sqrt(sum);
  };
  alignment.scale = extent(truth) / extent(arranged);
  alignment.translation = {};
  const Point2 there = alignment.apply(centre(arranged));
  const Point2 target = centre(truth);
  alignment.translation = {target.x_m - there.x_m, target.y_m - there.y_m};
  return alignment;
}

bool are_coincident(std::span<const Point2> points) {
  return std::ranges::all_of(points, [&](Point2 p) { return distance(p, points.front()) == 0.0; });
}

}  // namespace

ViewGrid record_grid(const simulation::PlaceRecording& place, int columns, int rows,
                     double spacing_m, GridHeadings headings, Executor& executor) {
  ViewGrid grid{.columns = columns,
                .rows = rows,
                .spacing_m = spacing_m,
                .memory = VisualMemory({1, 1}, 1.0F, std::nullopt)};
  const simulation::Scene& scene = place.scene;
  const double middle_x = 0.5 * (scene.floor_low.x_m + scene.floor_high.x_m);
  const double middle_y = 0.5 * (scene.floor_low.y_m + scene.floor_high.y_m);
  Random random(place.seed, 91);
  for (int view = 0; view < columns * rows; ++view) {
    const GridCell at = locate_in_grid(grid, static_cast<std::size_t>(view));
    grid.poses.push_back({middle_x + (at.i - 0.5 * (columns - 1)) * spacing_m,
                          middle_y + (at.j - 0.5 * (rows - 1)) * spacing_m,
                          random.uniform(-std::numbers::pi, std::numbers::pi)});
  }
  if (headings == GridHeadings::along_path) simulation::face_path(grid.poses);
  const auto views = simulation::capture_views(place, place.rendering, grid.poses,
                                               place.seed * 100003U + 90000U, {}, executor);
  grid.memory = make_memory(views, compute_signatures(views, m04_components, executor));
  return grid;
}

simulation::Scene make_small_room(std::uint64_t seed) {
  simulation::SceneBuilder builder("small_room", {.seed = seed});
  simulation::Scene& scene = builder.scene();
  scene.floor_low = {0.0, 0.0};
  scene.floor_high = {4.0, 3.5};
  scene.ambient = 0.4F;
  constexpr double room_height_m = 2.6;
  simulation::furnish_room_shell(builder, {{0.0, 0.0}, {4.0, 3.5}}, room_height_m);
  for (const double x_m : {1.2, 2.8}) {
    builder.add_lamp({x_m, 1.75, room_height_m - 0.2},
                     static_cast<float>(builder.random().uniform(0.3, 0.8)));
  }
  return builder.finish();
}

std::vector<CoarseMotion> simulate_coarse_motion(const ViewGrid& grid, double distance_share,
                                                 double direction_share, std::uint64_t seed) {
  Random random(seed, 92);
  // Standard deviation of a uniform distribution over [-1, 1].
  const double uniform_deviation = 1.0 / std::sqrt(3.0);
  const double max_rad = direction_share * std::numbers::pi;
  const auto views = grid.memory.views();
  std::vector<CoarseMotion> motions;
  for (std::size_t i = 0; i + 1 < grid.poses.size(); ++i) {
    const Pose2 step = inverse(grid.poses[i]) * grid.poses[i + 1];
    const double length_m = std::hypot(step.x_m, step.y_m);
    const double reported_m = length_m * (1.0 + random.uniform(-distance_share, distance_share));
    const double reported_rad = std::atan2(step.y_m, step.x_m) + random.uniform(-max_rad, max_rad);
    const double turned_rad = step.heading_rad + random.uniform(-max_rad, max_rad);
    motions.push_back({.from = views[i],
                       .to = views[i + 1],
                       .step = {reported_m * std::cos(reported_rad),
                                reported_m * std::sin(reported_rad), wrap_angle(turned_rad)},
                       .distance_deviation_m = uniform_deviation * distance_share * reported_m,
                       .direction_deviation_rad = uniform_deviation * max_rad,
                       .turn_deviation_rad = uniform_deviation * max_rad});
  }
  return motions;
}

GridComparison compare_with_grid(const ViewGrid& grid, const Lattice& lattice) {
  const auto truth = positions_of(grid.poses);
  std::vector<Point2> arranged;
  for (const auto& node : lattice.nodes) {
    // Views of other components have no position in this frame; the origin is used instead.
    arranged.push_back(node.component == 0 ? node.pose.position() : Point2{});
  }
  GridComparison result;
  if (are_coincident(arranged)) {
    result.aligned = std::vector<Point2>(truth.size(), truth.front());
    return result;
  }
  const ShapeDifference difference = shape_difference(arranged, truth);
  result.shape_difference = difference.value;
  result.with_reflection = difference.with_reflection;
  Alignment alignment = align(arranged, truth, {.allow_scale = true, .allow_reflection = true});
  alignment = match_extent(truth, arranged, alignment);
  for (const Point2 p : arranged) result.aligned.push_back(alignment.apply(p));

  const std::vector<std::size_t> same_component(truth.size(), 0);
  const auto near = nearest_points(arranged, same_component, 8);
  const double middle_x =
      0.5 * (truth.front().x_m + truth[view_index(grid, {grid.columns - 1, 0})].x_m);
  const double middle_y =
      0.5 * (truth.front().y_m + truth[view_index(grid, {0, grid.rows - 1})].y_m);
  std::size_t inner = 0;
  std::size_t kept = 0;
  double inward_shift_m = 0.0;
  double sides = 0.0;
  for (std::size_t view = 0; view < truth.size(); ++view) {
    const GridCell at = locate_in_grid(grid, view);
    if (is_inner(grid, at)) {
      ++inner;
      bool all = lattice.nodes[view].component == 0;
      for (const GridCell next : {GridCell{at.i - 1, at.j}, GridCell{at.i + 1, at.j},
                                  GridCell{at.i, at.j - 1}, GridCell{at.i, at.j + 1}}) {
        all = all && std::ranges::find(near[view], view_index(grid, next)) != near[view].end();
      }
      kept += all ? 1 : 0;
      continue;
    }
    // Add the inward shift for each side of the grid on which the view lies.
    if (at.i == 0 || at.i == grid.columns - 1) {
      const double sign = truth[view].x_m < middle_x ? 1.0 : -1.0;
      inward_shift_m += sign * (result.aligned[view].x_m - truth[view].x_m);
      sides += 1.0;
    }
    if (at.j == 0 || at.j == grid.rows - 1) {
      const double sign = truth[view].y_m < middle_y ? 1.0 : -1.0;
      inward_shift_m += sign * (result.aligned[view].y_m - truth[view].y_m);
      sides += 1.0;
    }
  }
  result.four_of_eight = inner > 0 ? static_cast<double>(kept) / static_cast<double>(inner) : 1.0;
  result.border_pull = inward_shift_m / sides / grid.spacing_m;
  return result;
}

std::vector<double> turn_errors(const ViewGrid& grid, const Lattice& lattice) {
  std::vector<double> errors;
  for (const auto& spring : lattice.springs) {
    const Pose2& a = grid.poses[spring.a];
    const Pose2& b = grid.poses[spring.b];
    if (!spring.phases || distance(a.position(), b.position()) > 1.01 * grid.spacing_m) continue;
    const double truly_rad = angle_difference(b.heading_rad, a.heading_rad);
    errors.push_back(std::abs(angle_difference(spring.phases->turn_rad, truly_rad)));
  }
  return errors;
}

std::vector<std::vector<Point2>> grid_lines(const ViewGrid& grid,
                                            std::span<const Point2> positions) {
  std::vector<std::vector<Point2>> lines;
  for (int j = 0; j < grid.rows; ++j) {
    auto& line = lines.emplace_back();
    for (int i = 0; i < grid.columns; ++i) line.push_back(positions[view_index(grid, {i, j})]);
  }
  for (int i = 0; i < grid.columns; ++i) {
    auto& line = lines.emplace_back();
    for (int j = 0; j < grid.rows; ++j) line.push_back(positions[view_index(grid, {i, j})]);
  }
  return lines;
}

}  // namespace panonav::lab
