#include "panonav_simulation/memory_mission.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/memory_map.hpp"

namespace panonav::simulation {

namespace {

/// Returns the true poses of the views, by node of the graph; NaN where the memory does not state
/// them. Positions from the memory's own map are in another frame than the scene.
std::vector<Pose2> collect_true_poses(const NavigationGraph& graph, const MemoryFile& file) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  constexpr std::size_t batch = 1024;  // views loaded at a time
  const bool is_true = !has_positions_from_map(file);
  std::vector<Pose2> poses;
  for (std::size_t begin = 0; begin < graph.size(); begin += batch) {
    const auto views = graph.views().subspan(begin, std::min(batch, graph.size() - begin));
    const VisualMemory memory = file.load(views);
    for (const ViewId view : views) {
      const auto& pose = is_true ? memory.info(view).pose : std::nullopt;
      poses.push_back(pose ? Pose2{pose->x_m, pose->y_m, pose->heading_rad.value_or(unknown)}
                           : Pose2{unknown, unknown, unknown});
    }
  }
  return poses;
}

/// Returns the median length of the edges between views with known positions; 0 if there are none.
double median_edge_m(const NavigationGraph& graph, const std::vector<Pose2>& truth) {
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    const double length = distance(truth[*graph.node_of(edge.a)].position(),
                                   truth[*graph.node_of(edge.b)].position());
    if (std::isfinite(length)) lengths.push_back(length);
  }
  return lengths.empty() ? 0.0 : upper_median(std::move(lengths));
}

}  // namespace

MissionPlace make_mission_place(const SimulatedWorld& world) {
  MissionPlace place;
  place.scene = world.scene();
  place.free_space = world.shared_free_space();
  place.renderer = world.shared_renderer();
  place.sensor = world.options().sensor;
  place.scene.robot_radius_m = world.options().free_space.robot_radius_m;
  place.scene.camera_height_m = world.options().frame.camera_height_m;
  return place;
}

RememberedPlace make_remembered_place(const RobotNavigator& robot) {
  const MemoryHeader& header = robot.memory().header();
  std::vector<Pose2> truth = collect_true_poses(robot.graph(), robot.memory());
  const double spacing_m = median_edge_m(robot.graph(), truth);
  return {VisualMemory(header.shape, header.full_scale, header.elevations), robot.graph(),
          std::move(truth), spacing_m};
}

std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> make_view_sensor(
    std::shared_ptr<const Renderer> renderer, const RecordingCamera& camera,
    const FrameOptions& frame, const SensorOptions& sensor,
    std::shared_ptr<const ViewEncoder> encoder, Executor* executor, ImageReport report) {
  return [=, renderer = std::move(renderer), encoder = std::move(encoder),
          report = std::move(report)](const Pose2& pose, std::uint64_t seed) {
    Executor one_thread(1);
    const Image image = capture_image(*renderer, pose, camera, frame, sensor, seed,
                                      executor == nullptr ? one_thread : *executor);
    const Panorama panorama = encoder->panorama(image.view());
    if (report) report(image, panorama);
    return encoder->signature(panorama);
  };
}

MissionPlace make_mission_place(const std::string& scene, SimulatedWorldOptions options,
                                const RobotNavigator& robot, const FindSetOption& find_set_option,
                                Executor& executor, ImageReport report) {
  const MemoryHeader& header = robot.memory().header();
  const bool mirror = header.source.kind == PictureKind::mirror;
  if (!mirror) {
    if (!header.elevations) {
      throw FileError(robot.memory().path().string(),
                      "does not say which elevations its views show, so no camera of a simulated "
                      "robot fits them; make it from a data set with elevation_deg");
    }
    const PanoramaShape shape =
        header.picture_shape.value_or(PanoramaShape{header.shape.rows, header.panorama_columns});
    options.simulation.kind = 1;
    options.simulation.rows = shape.rows;
    options.simulation.columns = shape.columns;
    options.simulation.elevation_low_deg = degrees(header.elevations->bottom_rad);
    options.simulation.elevation_high_deg = degrees(header.elevations->top_rad);
  }
  const SimulatedWorld world(scene, options, find_set_option, executor);
  const RecordingCamera camera = mirror ? RecordingCamera(*header.source.camera) : world.camera();
  const PictureSource source = mirror ? header.source : world.source();
  MissionPlace place = make_mission_place(world);
  const SimulatedWorldOptions& final_options = world.options();
  place.view_sensor = make_view_sensor(
      place.renderer, camera, final_options.frame, final_options.sensor,
      std::make_shared<const ViewEncoder>(header, source), &executor, std::move(report));
  if (const RouteSource* const route = robot.route()) {
    place.line = [renderer = place.renderer, camera, frame = final_options.frame,
                  sensor = final_options.sensor,
                  encoder = std::make_shared<LineEncoder>(source, *route),
                  &executor](const Pose2& pose, std::uint64_t seed) {
      return encoder->line(capture_image(*renderer, pose, camera, frame, sensor, seed, executor));
    };
  }
  return place;
}

}  // namespace panonav::simulation
