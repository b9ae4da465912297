#include "verbs/navigated_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

namespace {

/// By node; not a number where nobody knows.
std::vector<Pose2> true_poses(const NavigationGraph& graph, const MemoryFile& file) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  constexpr std::size_t at_once = 1024;
  std::vector<Pose2> poses;
  for (std::size_t begin = 0; begin < graph.size(); begin += at_once) {
    const auto some = graph.views().subspan(begin, std::min(at_once, graph.size() - begin));
    const VisualMemory memory = file.load(some);
    for (const ViewId view : some) {
      const auto& pose = memory.info(view).pose;
      poses.push_back(pose ? Pose2{pose->x_m, pose->y_m, pose->heading_rad.value_or(unknown)}
                           : Pose2{unknown, unknown, unknown});
    }
  }
  return poses;
}

/// Median length of the edges between views whose places are known; 0 without any.
double spacing_of(const NavigationGraph& graph, const std::vector<Pose2>& truth) {
  std::vector<double> lengths;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    const double length = distance(truth[*graph.node_of(edge.a)].position(),
                                   truth[*graph.node_of(edge.b)].position());
    if (std::isfinite(length)) lengths.push_back(length);
  }
  return lengths.empty() ? 0.0 : upper_median(std::move(lengths));
}

}  // namespace

simulation::RememberedPlace remembered_by(const RobotNavigator& robot) {
  const MemoryHeader& header = robot.memory().header();
  std::vector<Pose2> truth = true_poses(robot.graph(), robot.memory());
  const double spacing_m = spacing_of(robot.graph(), truth);
  return {VisualMemory(header.shape, header.full_scale, header.elevations), robot.graph(),
          std::move(truth), spacing_m};
}

std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> sight_through(
    std::shared_ptr<const simulation::Renderer> renderer, const simulation::RecordingCamera& camera,
    const simulation::FrameOptions& frame, const simulation::SensorOptions& sensor,
    std::shared_ptr<const ViewEncoder> pipeline, Executor* executor, SightReport seen) {
  return [renderer = std::move(renderer), camera, frame, sensor, pipeline = std::move(pipeline),
          executor, seen = std::move(seen)](const Pose2& pose, std::uint64_t seed) {
    Executor here(1);
    const Image picture = simulation::take_picture(*renderer, pose, camera, frame, sensor, seed,
                                                   executor == nullptr ? here : *executor);
    const Panorama panorama = pipeline->panorama(picture.view());
    if (seen) seen(picture, panorama);
    return pipeline->signature(panorama);
  };
}

simulation::MissionPlace place_as_remembered(const std::string& scene,
                                             simulation::SimulatedWorldOptions wanted,
                                             const RobotNavigator& robot,
                                             const simulation::GivenOption& given, Session& session,
                                             SightReport seen) {
  const MemoryHeader& header = robot.memory().header();
  const bool mirror = header.source.kind == PictureKind::mirror;
  if (!mirror) {
    if (!header.elevations) {
      throw FileError(robot.memory().path().string(),
                      "does not say which elevations its views show, so no camera of a simulated "
                      "robot sees alike; make it from a data set with elevation_deg");
    }
    const PanoramaShape shape =
        header.picture_shape.value_or(PanoramaShape{header.shape.rows, header.panorama_columns});
    wanted.simulation.kind = 1;
    wanted.simulation.rows = shape.rows;
    wanted.simulation.columns = shape.columns;
    wanted.simulation.elevation_low_deg = degrees(header.elevations->bottom_rad);
    wanted.simulation.elevation_high_deg = degrees(header.elevations->top_rad);
  }
  const simulation::SimulatedWorld world(scene, wanted, given, session.executor());
  for (const auto& warning : world.scene().warnings) session.note("warning: " + warning);
  const simulation::RecordingCamera camera =
      mirror ? simulation::RecordingCamera(*header.source.camera) : world.camera();
  const PictureSource source = mirror ? header.source : world.source();
  const auto pipeline = std::make_shared<const ViewEncoder>(header, source);
  simulation::MissionPlace place = mission_place(world);
  const simulation::SimulatedWorldOptions& settled = world.options();
  place.sight = sight_through(place.renderer, camera, settled.frame, settled.sensor, pipeline,
                              &session.executor(), std::move(seen));
  if (const RouteSource* const route = robot.route()) {
    place.line = [renderer = place.renderer, camera, frame = settled.frame, sensor = settled.sensor,
                  encoder = std::make_shared<LineEncoder>(source, *route),
                  &session](const Pose2& pose, std::uint64_t seed) {
      return encoder->line(simulation::take_picture(*renderer, pose, camera, frame, sensor, seed,
                                                    session.executor()));
    };
  }
  return place;
}

}  // namespace panonav::command
