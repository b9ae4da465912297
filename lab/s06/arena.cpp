#include "lab/s06/arena.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::lab {

namespace {

constexpr int camera_columns = 360;
constexpr int camera_rows = 10;
constexpr double half_band_rad = 5.0 * std::numbers::pi / 180.0;

ArenaRecording record_views(const simulation::Renderer& renderer, const simulation::Scene& scene,
                            std::span<const simulation::GridPosition> grid,
                            const ArenaOptions& options, std::uint64_t stream, Executor& executor) {
  std::vector<std::optional<ArenaView>> views(grid.size());
  std::vector<std::vector<float>> rows(grid.size());
  executor.for_each_chunk(grid.size(), 8, [&](std::size_t begin, std::size_t end, std::size_t) {
    Executor here(1);
    for (std::size_t i = begin; i < end; ++i) {
      Random random(options.seed, 2 * i + stream);
      const Point2 position = grid[i].position;
      const double heading = options.heading == ArenaHeading::fixed
                                 ? 0.0
                                 : random.uniform(-std::numbers::pi, std::numbers::pi);
      const double error_x = random.normal();
      const double error_y = random.normal();
      const double error_heading = random.normal();
      const Pose2 truth{position.x_m + options.position_noise_m * error_x,
                        position.y_m + options.position_noise_m * error_y,
                        wrap_angle(heading + options.heading_noise_rad * error_heading)};
      rows[i] = render_arena_row(renderer, scene, options.rendering, truth, random.next(), here);
      const Panorama one_row(1, s06_columns, std::nullopt, rows[i]);
      views[i] = ArenaView{{position.x_m, position.y_m, heading},
                           homing_view(compute_signature(one_row, s06_components))};
    }
  });
  ArenaRecording recording;
  recording.rows = std::move(rows);
  for (auto& view : views) recording.views.push_back(std::move(*view));
  return recording;
}

std::vector<Pose2> collect_poses(const ArenaRecording& recording) {
  std::vector<Pose2> poses;
  for (const auto& view : recording.views) poses.push_back(view.pose);
  return poses;
}

}  // namespace

simulation::PanoramaRendering make_arena_rendering(Optics optics) {
  constexpr ElevationBand around_horizon{-half_band_rad, half_band_rad};
  if (optics == Optics::mirror)
    return simulation::make_mirror_rendering(camera_rows, camera_columns, around_horizon);
  return {.rows = camera_rows, .columns = camera_columns, .elevations = around_horizon};
}

std::vector<float> render_arena_row(const simulation::Renderer& renderer,
                                    const simulation::Scene& scene,
                                    const simulation::PanoramaRendering& rendering,
                                    const Pose2& pose, std::uint64_t seed, Executor& executor) {
  const Panorama view = simulation::capture_panorama(
      renderer, pose, rendering, {.camera_height_m = scene.camera_height_m}, {}, seed, executor);
  constexpr int ratio = camera_columns / s06_columns;
  std::vector<float> row(s06_columns);
  for (int c = 0; c < s06_columns; ++c) {
    float sum = 0.0F;
    for (int y = 0; y < camera_rows; ++y) {
      // Pixel c of both images is centred on azimuth 2 pi c / columns, so the edge pixels of the
      // sum belong to two.
      for (int i = -ratio / 2; i <= ratio / 2; ++i) {
        sum += view.at(y, (ratio * c + i + camera_columns) % camera_columns);
      }
    }
    row[static_cast<std::size_t>(c)] = sum / static_cast<float>(ratio * camera_rows);
  }
  return row;
}

Arena record_arena(const ArenaOptions& options, Executor& executor) {
  Arena arena{
      simulation::make_place(simulation::make_scene("arena", {.seed = options.seed}), executor),
      options};
  std::vector<simulation::GridPosition> grid;
  for (const simulation::GridPosition& place : arena.free_space->grid(options.spacing_m)) {
    const Point2 at = place.position;
    const Point2 low = arena.scene.floor_low;
    const Point2 high = arena.scene.floor_high;
    if (at.x_m >= low.x_m + s06_margin_m && at.x_m <= high.x_m - s06_margin_m &&
        at.y_m >= low.y_m + s06_margin_m && at.y_m <= high.y_m - s06_margin_m) {
      grid.push_back(place);
    }
  }
  require(!grid.empty(), "free places", 0.0, ">= 1");
  arena.homes = record_views(*arena.renderer, arena.scene, grid, options, 0, executor);
  const simulation::Scene later =
      simulation::make_scene("arena", {.seed = options.seed, .light = options.light});
  const simulation::Renderer second(later, {}, executor);
  arena.currents = record_views(second, later, grid, options, 1, executor);
  return arena;
}

HomingSurveyOptions survey_options(const Arena& arena) {
  // Equal to the values of [S06] at a spacing of 2.5 cm.
  return {.typical_distance_m = 0.5,
          .max_step_m = 2.0 * arena.options.spacing_m,
          .obstacle_m = 0.8 * arena.options.spacing_m};
}

HomingSurvey survey_arena(const Arena& arena, const HomingRule& rule, Executor& executor,
                          std::size_t goal_stride) {
  std::vector<Pose2> goals;
  for (std::size_t g = 0; g < arena.homes.views.size(); g += goal_stride) {
    goals.push_back(arena.homes.views[g].pose);
  }
  return survey_homing(
      goals, collect_poses(arena.currents),
      [&](std::size_t goal, std::size_t place) { return rule(goal * goal_stride, place); },
      survey_options(arena), executor);
}

HomingSurvey survey_arena(const Arena& arena, const FourierHomingOptions& homing,
                          Executor& executor, std::size_t goal_stride) {
  validate(homing);
  return survey_arena(
      arena,
      [&](std::size_t goal, std::size_t place) {
        return home_vector_unchecked(arena.homes.views[goal].view, arena.currents.views[place].view,
                                     homing);
      },
      executor, goal_stride);
}

HomingSurvey survey_arena(const Arena& arena, const ExpectedImageHoming& homing, Executor& executor,
                          std::size_t goal_stride) {
  return survey_arena(
      arena,
      [&](std::size_t goal, std::size_t place) {
        return homing.home_vector(arena.homes.rows[goal], arena.currents.rows[place]);
      },
      executor, goal_stride);
}

}  // namespace panonav::lab
