#include "panonav_simulation/place_recording.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"

namespace panonav::simulation {

namespace {

PanoramaRendering make_place_rendering(const PlaceRecordingOptions& options) {
  if (options.mirror) return make_mirror_rendering(options.rows, options.columns);
  return {.rows = options.rows, .columns = options.columns, .rays_per_axis = 1};
}

}  // namespace

SimulatedPlace make_place(Scene scene, Executor& executor, std::optional<Point2> inside) {
  auto space = std::make_shared<const FreeSpace>(scene, free_space_options(scene), inside);
  auto renderer = std::make_shared<const Renderer>(scene, RendererOptions{}, executor);
  return {std::move(scene), std::move(space), std::move(renderer)};
}

void add_floor_camera(SimulatedPlace& place, const SensorOptions& sensor) {
  place.floor_camera = std::make_shared<const FloorCamera>(
      place.renderer,
      FloorScannerOptions{.camera_height_m = place.scene.camera_height_m,
                          .robot_radius_m = place.scene.robot_radius_m},
      sensor);
}

std::size_t PlaceRecording::nearest_reference(Point2 position) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < references.size(); ++i) {
    if (distance(references[i].pose.position(), position) <
        distance(references[nearest].pose.position(), position)) {
      nearest = i;
    }
  }
  return nearest;
}

Panorama capture_view(const PlaceRecording& place, const PanoramaRendering& rendering,
                      const Pose2& pose, std::uint64_t seed, const SensorOptions& sensor) {
  Executor here(1);
  return capture_panorama(*place.renderer, pose, rendering,
                          {.camera_height_m = place.scene.camera_height_m}, sensor, seed, here);
}

Panorama capture_view(const PlaceRecording& place, const Pose2& pose, std::uint64_t seed,
                      const SensorOptions& sensor) {
  return capture_view(place, place.rendering, pose, seed, sensor);
}

std::vector<PlacedView> capture_views(const PlaceRecording& place,
                                      const PanoramaRendering& rendering,
                                      const std::vector<Pose2>& poses, std::uint64_t first_seed,
                                      const SensorOptions& sensor, Executor& executor) {
  return make_each(executor, poses.size(), [&](std::size_t i) {
    return PlacedView{poses[i], capture_view(place, rendering, poses[i], first_seed + i, sensor)};
  });
}

std::vector<PlacedView> recapture_queries(const PlaceRecording& place, const SensorOptions& sensor,
                                          std::uint64_t first_seed, Executor& executor) {
  std::vector<Pose2> poses;
  for (const PlacedView& query : place.queries) poses.push_back(query.pose);
  return capture_views(place, place.rendering, poses, first_seed, sensor, executor);
}

PlaceRecording record_place(const PlaceRecordingOptions& options, Executor& executor) {
  return record_place(make_scene(options.scene, {.seed = options.seed}), options, executor);
}

PlaceRecording record_place(Scene scene, const PlaceRecordingOptions& options, Executor& executor) {
  require(options.queries >= 1, "queries", options.queries, ">= 1");
  PlaceRecording place{make_place(std::move(scene), executor)};
  place.seed = options.seed;
  place.spacing_m = options.spacing_m;
  place.rendering = make_place_rendering(options);

  std::vector<Pose2> grid;
  for (const auto& point : place.free_space->grid(options.spacing_m)) {
    grid.push_back({point.position.x_m, point.position.y_m, 0.0});
  }
  require(!grid.empty(), "reference views", 0.0, ">= 1");
  Random random(options.seed, 77);
  std::vector<Pose2> query_poses;
  for (int q = 0; q < options.queries; ++q)
    query_poses.push_back(place.free_space->random_pose(random));
  const std::uint64_t noise = options.seed * 100003U;
  place.references = capture_views(place, place.rendering, grid, noise, {}, executor);
  place.queries =
      capture_views(place, place.rendering, query_poses, noise + grid.size(), {}, executor);
  return place;
}

}  // namespace panonav::simulation
