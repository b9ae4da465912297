#include "verbs/navigated_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/lattice.hpp"

namespace panonav::command {

namespace {

constexpr std::array<std::string_view, 4> origin_names{"map", "lattice", "links", "arrangement"};

/// Empty when the file has nothing of the kind.
std::optional<NavigationGraph> graph_from(GraphOrigin origin, const MemoryFile& file,
                                          const VisualMemory& memory, Executor& executor) {
  switch (origin) {
    case GraphOrigin::map: {
      const auto map = file.map("map");
      if (!map) return std::nullopt;
      return graph_of_map_and_neighbours(*map, memory, executor);
    }
    case GraphOrigin::lattice: {
      const auto map = file.map("lattice");
      if (!map) return std::nullopt;
      return graph_of_stored_lattice(*map, MemoryViewSource(memory), executor);
    }
    case GraphOrigin::links:
      if (memory.links().empty()) return std::nullopt;
      return graph_of_memory(memory, executor);
    case GraphOrigin::arrangement:
      return graph_of_lattice(arrange(memory, {}, {}, executor));
  }
  return std::nullopt;
}

/// By node; not a number where nobody knows.
std::vector<Pose2> true_poses(const NavigationGraph& graph, const VisualMemory& memory) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<Pose2> poses;
  for (const ViewId view : graph.views()) {
    const auto& pose = memory.info(view).pose;
    poses.push_back(pose ? Pose2{pose->x_m, pose->y_m, pose->heading_rad.value_or(unknown)}
                         : Pose2{unknown, unknown, unknown});
  }
  return poses;
}

/// Median length of the edges between views whose places are known; 0 without any.
double spacing_of(const NavigationGraph& graph, const std::vector<Pose2>& truth) {
  std::vector<double> lengths;
  for (const NavigationEdge& edge : graph.edges()) {
    const double length = distance(truth[*graph.node_of(edge.a)].position(),
                                   truth[*graph.node_of(edge.b)].position());
    if (std::isfinite(length)) lengths.push_back(length);
  }
  return lengths.empty() ? 0.0 : upper_median(std::move(lengths));
}

}  // namespace

std::string_view name_of(GraphOrigin origin) {
  return origin_names.at(static_cast<std::size_t>(origin));
}

std::optional<GraphOrigin> graph_origin(std::string_view name) {
  const auto found = std::ranges::find(origin_names, name);
  if (found == origin_names.end()) return std::nullopt;
  return static_cast<GraphOrigin>(found - origin_names.begin());
}

Remembered remember(const MemoryFile& file, std::optional<GraphOrigin> wanted, Executor& executor) {
  VisualMemory memory = file.load();
  if (memory.empty()) throw FileError(file.path().string(), "holds no views; allowed: 2 or more");
  std::optional<NavigationGraph> graph;
  GraphOrigin origin = wanted.value_or(GraphOrigin::map);
  if (wanted) {
    graph = graph_from(*wanted, file, memory, executor);
    if (!graph) {
      throw FileError(file.path().string(), "has no " + std::string(name_of(*wanted)) +
                                                "; leave out --passages for what there is");
    }
  }
  for (std::size_t i = 0; !graph; ++i) {
    origin = static_cast<GraphOrigin>(i);
    graph = graph_from(origin, file, memory, executor);
  }
  std::vector<Pose2> truth = true_poses(*graph, memory);
  const double spacing_m = spacing_of(*graph, truth);
  return {{std::move(memory), std::move(*graph), std::move(truth), spacing_m}, origin};
}

KnownRoute route_among_views(const MemoryFile& file, const std::string& name,
                             const VisualMemory& memory, const KnownRouteOptions& options) {
  const std::string path = file.path().string();
  const auto route = file.route(name);
  if (!route) {
    std::string all;
    for (const auto& known : file.route_names()) all += (all.empty() ? "" : ", ") + known;
    throw FileError(path, "holds no route '" + name + "'; allowed for --route: " +
                              (all.empty() ? "none, as panonav route record made none" : all));
  }
  if (route->size() < 2) {
    throw FileError(path, "route '" + name + "' has 1 line; allowed: 2 or more");
  }
  if (route_source(file, name, route->columns()).from_odometry) {
    throw FileError(path, "route '" + name +
                              "' is in the frame of its odometry, where no view is known to lie; "
                              "allowed: one recorded with the poses of a data set");
  }
  std::vector<RouteView> views;
  for (const ViewId view : memory.views()) {
    const auto& pose = memory.info(view).pose;
    if (pose) views.push_back({view, {pose->x_m, pose->y_m, pose->heading_rad.value_or(0.0)}});
  }
  KnownRoute known = known_route(*route, views, options);
  if (known.references.empty()) {
    throw FileError(
        path, "none of the " + std::to_string(views.size()) + " views with a pose lies within " +
                  short_number(options.beside_m) + " m of the route '" + name +
                  "'; allowed: views and a route in one frame, or a larger --route-beside-m");
  }
  return known;
}

std::function<FourierSignature(const Pose2& pose, std::uint64_t seed)> sight_through(
    std::shared_ptr<const Renderer> renderer, const RecordingCamera& camera,
    const FrameOptions& frame, const SensorOptions& sensor,
    std::shared_ptr<const ViewEncoder> pipeline, Executor* executor) {
  return [renderer = std::move(renderer), camera, frame, sensor, pipeline = std::move(pipeline),
          executor](const Pose2& pose, std::uint64_t seed) {
    Executor here(1);
    const Image picture = take_picture(*renderer, pose, camera, frame, sensor, seed,
                                       executor == nullptr ? here : *executor);
    return pipeline->signature(pipeline->panorama(picture.view()));
  };
}

MissionPlace place_as_remembered(
    const std::string& scene, SimulationArguments wanted, const MemoryFile& memory,
    const std::optional<RouteSource>& route,
    const std::function<bool(const std::string&, const std::string&)>& given, Session& session) {
  const MemoryHeader& header = memory.header();
  const bool mirror = header.source.kind == PictureKind::mirror;
  if (!mirror) {
    if (!header.elevations) {
      throw FileError(memory.path().string(),
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
  const SimulatedWorld world(scene, wanted, given, session.executor());
  for (const auto& warning : world.scene().warnings) session.note("warning: " + warning);
  const RecordingCamera camera = mirror ? RecordingCamera(*header.source.camera) : world.camera();
  const PictureSource source = mirror ? header.source : world.source();
  const auto pipeline = std::make_shared<const ViewEncoder>(header, source);
  MissionPlace place = world.place();
  const SimulationArguments& settled = world.arguments();
  place.sight = sight_through(place.renderer, camera, settled.frame, settled.sensor, pipeline,
                              &session.executor());
  if (route) {
    place.line = [renderer = place.renderer, camera, frame = settled.frame, sensor = settled.sensor,
                  reader = std::make_shared<LineReader>(source, *route),
                  &session](const Pose2& pose, std::uint64_t seed) {
      const Image picture =
          take_picture(*renderer, pose, camera, frame, sensor, seed, session.executor());
      return reader->convert(picture.view());
    };
  }
  return place;
}

}  // namespace panonav::command
