#include "panonav/pipeline/robot_navigator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/learnt_route.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav {

namespace {

constexpr std::array<std::string_view, 4> origin_names{"map", "lattice", "links", "arrangement"};

/// Loads the graph of this origin; nullopt if the file does not have it.
std::optional<NavigationGraph> load_graph(RobotNavigatorOptions::GraphOrigin origin,
                                          const MemoryFileViews& source, Executor& executor) {
  const MemoryFile& file = source.file();
  switch (origin) {
    case RobotNavigatorOptions::GraphOrigin::map: {
      auto map = file.map(map_name);
      if (!map) return std::nullopt;
      scale_lengths(*map, read_assumed_unit_m(file));
      std::vector<ViewId> views;
      for (const TopologicalMap::Node& node : map->nodes) views.push_back(node.view);
      return make_graph_from_map_and_neighbours(*map, file.load(views), executor);
    }
    case RobotNavigatorOptions::GraphOrigin::lattice: {
      const auto map = file.map("lattice");
      if (!map) return std::nullopt;
      return graph_from_stored_lattice(*map, source, executor);
    }
    case RobotNavigatorOptions::GraphOrigin::links: {
      const std::vector<Link> links = file.links();
      if (links.empty()) return std::nullopt;
      return graph_from_links(source, links, executor);
    }
    case RobotNavigatorOptions::GraphOrigin::arrangement:
      return graph_from_lattice(arrange(file.load(), {}, {}, executor));
  }
  return std::nullopt;
}

NavigationGraph load_requested_graph(
    const MemoryFileViews& source,
    const std::optional<RobotNavigatorOptions::GraphOrigin>& requested,
    RobotNavigatorOptions::GraphOrigin& origin, Executor& executor) {
  const std::string path = source.file().path().string();
  if (source.views().empty()) throw FileError(path, "contains no views; allowed: 2 or more");
  if (requested) {
    origin = *requested;
    auto graph = load_graph(origin, source, executor);
    if (graph) return std::move(*graph);
    throw FileError(path, "has no " + std::string(to_string(origin)) +
                              "; leave out the option edges to use the existing edges");
  }
  for (std::size_t i = 0;; ++i) {
    origin = static_cast<RobotNavigatorOptions::GraphOrigin>(i);
    auto graph = load_graph(origin, source, executor);
    if (graph) return std::move(*graph);
  }
}

/// Leaves out edges between two floors.
NavigationGraph keep_edges_on_floors(NavigationGraph graph, const MemoryFile& file) {
  const std::vector<ViewId> views = file.views();
  const std::vector<std::string> names = file.names();
  const auto floor = [&](ViewId view) {
    const auto found = std::ranges::lower_bound(views, view) - views.begin();
    return floor_of(names.at(static_cast<std::size_t>(found)));
  };
  std::vector<NavigationGraph::Edge> kept;
  for (const NavigationGraph::Edge& edge : graph.edges()) {
    if (floor(edge.a) == floor(edge.b)) kept.push_back(edge);
  }
  if (kept.size() == graph.edges().size()) return graph;
  return {{graph.views().begin(), graph.views().end()}, std::move(kept)};
}

/// Returns the route with the views near it. Route and views must have been recorded with the
/// poses of the same data set.
KnownRoute load_known_route(const MemoryFileViews& source, const std::string& name,
                            const KnownRouteOptions& options) {
  const MemoryFile& file = source.file();
  const std::string path = file.path().string();
  if (!file.route(name)) {
    std::string all;
    for (const auto& known : file.route_names()) all += (all.empty() ? "" : ", ") + known;
    throw FileError(path, "contains no route '" + name + "'; allowed for the option route: " +
                              (all.empty() ? "none, because no route was recorded" : all));
  }
  if (read_length_unit(file) != LengthUnit::metres) {
    throw FileError(path,
                    "has positions in view steps; first scale it to metres, by the known distance "
                    "between two of its views");
  }
  const RoutePanorama route = load_route_to_follow(file, name);
  if (read_route_source(file, name, route.columns()).from_odometry) {
    throw FileError(
        path, "route '" + name +
                  "' is in the frame of its odometry, in which the positions of the views are "
                  "unknown; allowed: a route that was recorded with the poses of a data set");
  }
  std::vector<KnownRoute::View> views;
  constexpr std::size_t at_once = 1024;
  for (std::size_t begin = 0; begin < source.views().size(); begin += at_once) {
    const auto some =
        source.views().subspan(begin, std::min(at_once, source.views().size() - begin));
    const VisualMemory loaded = source.load(some);
    for (const ViewId view : some) {
      const auto& pose = loaded.info(view).pose;
      if (pose) views.push_back({view, {pose->x_m, pose->y_m, pose->heading_rad.value_or(0.0)}});
    }
  }
  KnownRoute known = make_known_route(
      route, views, options, load_route_limits(file, name, route, options.tracker, options.fit));
  if (known.references.empty()) {
    throw FileError(path, "none of the " + std::to_string(views.size()) +
                              " views with a pose lies within " +
                              format_number(options.max_lateral_m) + " m of the route '" + name +
                              "'; allowed: views and a route in one frame, or a larger value of "
                              "the option route_max_lateral_m");
  }
  return known;
}

}  // namespace

std::string_view to_string(RobotNavigatorOptions::GraphOrigin origin) {
  return origin_names.at(static_cast<std::size_t>(origin));
}

std::optional<RobotNavigatorOptions::GraphOrigin> parse_graph_origin(std::string_view name) {
  const auto found = std::ranges::find(origin_names, name);
  if (found == origin_names.end()) return std::nullopt;
  return static_cast<RobotNavigatorOptions::GraphOrigin>(found - origin_names.begin());
}

RobotNavigator::RobotNavigator(const std::filesystem::path& memory, const std::string& goal,
                               const RobotNavigatorOptions& options,
                               const std::optional<PictureSource>& source, Executor* executor)
    : options_(options),
      views_(memory),
      encoder_(views_.file().header(), source.value_or(views_.file().header().source)) {
  validate(options_.base);
  Executor own(1);
  NavigationGraph graph = keep_edges_on_floors(
      load_requested_graph(views_, options_.edges, origin_, executor == nullptr ? own : *executor),
      views_.file());
  navigator_.emplace(views_, AreaPlanner(std::move(graph), options_.planner), options_.navigator);
  set_goal(goal);
  if (!options_.route) return;
  routes_.push_back(load_known_route(views_, *options_.route, options_.known_route));
  const int columns = routes_.front().tracker.lines().columns();
  route_source_ = read_route_source(views_.file(), *options_.route, columns);
  line_encoder_.emplace(source.value_or(encoder_.header().source), *route_source_);
  navigator_->set_routes(routes_);
}

void RobotNavigator::set_goal(const std::string& goal) {
  const ViewId view = find_view_by_name_or_id(views_.file(), goal);
  const auto node = graph().node_of(view);
  if (!node || graph().exits(*node).empty()) {
    throw FileError(views_.file().path().string(),
                    "no edge leads to the view " + info(view).name +
                        "; choose another goal, or arrange the memory again");
  }
  goal_ = view;
  navigator_->set_goal(view);
  time_left_s_ = 0.0;
}

ReferenceInfo RobotNavigator::info(ViewId view) const {
  return views_.load({&view, 1}).info(view);
}

NavigationDecision RobotNavigator::observe(const Observation& observation, RobotReport report) {
  std::vector<float> line;
  if (line_encoder_ && report.line.empty()) {
    line = line_encoder_->line(observation);
    report.line = line;
  }
  report.moved = moved_;
  return navigator_->observe(encoder_.signature(observation), report);
}

std::string RobotNavigator::explain_other_floor(ViewId view) const {
  const std::string goal = info(goal_).name;
  const std::string here = info(view).name;
  if (floor_of(goal) == floor_of(here)) return {};
  const auto describe = [](std::string_view name) {
    const std::string_view floor = floor_of(name);
    return floor.empty() ? "on the floor without a name" : "on floor " + std::string(floor);
  };
  return "the goal is " + describe(goal) + ", the robot " + describe(here) + " at " + here +
         "; choose a goal on its floor";
}

RobotNavigator::Step RobotNavigator::step(const Observation& observation, RobotReport report) {
  constexpr double near_m = 0.003;
  const BaseOptions& base = options_.base;
  const Pose2 moved = odometry_ && observation.odometry
                          ? inverse(*odometry_) * *observation.odometry
                          : integrate_velocity(last_step_.velocity, base.period_s);
  if (observation.odometry) {
    odometry_ = observation.odometry;
  } else if (odometry_) {  // continued by the commands until the next odometry
    odometry_ = *odometry_ * moved;
  }
  moved_ = moved_ * moved;
  target_ = inverse(moved) * target_;
  time_left_s_ -= base.period_s;
  last_step_.decided =
      report.obstacle || time_left_s_ <= 0.0 || std::hypot(target_.x_m, target_.y_m) <= near_m;
  if (last_step_.decided) {
    last_step_.decision = observe(observation, report);
    moved_ = {};
    const double advance_m = last_step_.decision.advance_m;
    const double direction_rad = last_step_.decision.direction_rad;
    target_ = {advance_m * std::cos(direction_rad), advance_m * std::sin(direction_rad)};
    // Allows twice the expected time, since wheels may slip.
    time_left_s_ = 2.0 * (std::numbers::pi / base.turn_rad_s + advance_m / base.speed_m_s) + 1.0;
  }
  last_step_.velocity = {};
  const double left_m = std::hypot(target_.x_m, target_.y_m);
  if (last_step_.decision.state == NavigationDecision::State::moving && left_m > 0.0) {
    last_step_.velocity =
        compute_command_towards(std::atan2(target_.y_m, target_.x_m), left_m, base);
  }
  return last_step_;
}

}  // namespace panonav
