#include "panonav/evaluation/place_recording.hpp"

#include <numbers>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/simulation/renderer.hpp"
#include "panonav/simulation/scenes.hpp"
#include "panonav/simulation/sensor.hpp"

namespace panonav {

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

PlaceRecording record_place(const PlaceRecordingOptions& options, Executor& executor) {
  require(options.queries >= 1, "queries", options.queries, ">= 1");
  PlaceRecording recording;
  recording.scene = make_scene(options.scene, {.seed = options.seed});
  recording.spacing_m = options.spacing_m;
  recording.free_space =
      std::make_shared<const FreeSpace>(recording.scene, free_space_options(recording.scene));
  const auto renderer = std::make_shared<const Renderer>(recording.scene);
  const double height_m = recording.scene.camera_height_m;
  recording.take = [renderer, height_m, rows = options.rows, columns = options.columns](
                       const Pose2& pose, std::uint64_t seed) {
    Executor here(1);
    Panorama view =
        renderer->render_panorama({.pose = pose, .height_m = height_m},
                                  {.rows = rows, .columns = columns, .rays_per_axis = 1}, here);
    return apply_sensor(std::move(view), SensorOptions{}, seed);
  };

  std::vector<Pose2> poses;
  for (const auto& place : recording.free_space->grid(options.spacing_m)) {
    poses.push_back({place.position.x_m, place.position.y_m, 0.0});
  }
  const std::size_t reference_count = poses.size();
  Random random(options.seed, 77);
  for (int q = 0; q < options.queries; ++q) {
    poses.push_back(recording.free_space->random_pose(random));
  }
  std::vector<std::optional<PlacedView>> views(poses.size());
  executor.for_chunks(poses.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      views[i] = PlacedView{poses[i], recording.take(poses[i], options.seed * 100003U + i)};
    }
  });
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto& list = i < reference_count ? recording.references : recording.queries;
    list.push_back(std::move(*views[i]));
  }
  require(!recording.references.empty(), "reference views", 0.0, ">= 1");
  return recording;
}

}  // namespace panonav
