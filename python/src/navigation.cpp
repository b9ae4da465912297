#include <algorithm>
#include <cmath>

#include "memories.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/robot_explorer.hpp"
#include "panonav/pipeline/robot_navigator.hpp"

namespace panonav::python {

namespace {

RobotNavigatorOptions make_navigator_options(const std::optional<std::string>& edges,
                                             const std::optional<std::string>& route,
                                             const py::kwargs& keywords) {
  RobotNavigatorOptions options{.route = route};
  if (edges) {
    options.edges = parse_graph_origin(*edges);
    if (!options.edges) {
      throw ContractError("edges", "'" + *edges + "'", "map, lattice, links, arrangement");
    }
  }
  Keywords parsed(keywords);
  parsed.options(options.navigator).options(options.planner).options(options.base);
  if (route) parsed.options(options.known_route, "route");
  parsed.finish();
  return options;
}

/// Converts rows of direction_rad and length_m.
std::vector<ExplorationReport::Range> to_ranges(const py::object& rows, double max_range_m,
                                                double deviation_m) {
  std::vector<ExplorationReport::Range> ranges;
  if (rows.is_none()) return ranges;
  const auto numbers = to_number_rows(rows, "ranges", 2);
  const auto values = numbers.unchecked<2>();
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    require(std::isfinite(values(i, 0)), "direction of a range", values(i, 0), "finite");
    require(values(i, 1) >= 0.0, "length of a range", values(i, 1), ">= 0");
    ranges.push_back({values(i, 0), std::min(values(i, 1), max_range_m), values(i, 1) < max_range_m,
                      deviation_m});
  }
  return ranges;
}

RobotExplorerOptions read_explorer_options(double robot_radius_m, bool has_ranges,
                                           const py::kwargs& keywords) {
  RobotExplorerOptions options{.robot_radius_m = robot_radius_m, .has_ranges = has_ranges};
  Keywords(keywords)
      .options(options.exploration)
      .options(options.base)
      .options(options.odometry, "odometry")
      .options(options.signature)
      .options(options.preprocessing)
      .finish();
  return options;
}

void bind_exploration_records(py::module_& m) {
  Record<ExplorationDecision>(m, "ExplorationDecision", "One decision of an exploring robot.")
      .field(
          "state", [](const ExplorationDecision& d) { return to_string(d.state); },
          "'exploring', 'recovering', 'returning', 'done' or 'lost'.")
      .field("direction_rad", &ExplorationDecision::direction_rad, "In the current robot frame.")
      .field("advance_m", &ExplorationDecision::advance_m, "Distance to drive; 0 at the end.")
      .field("memorise", &ExplorationDecision::memorise, "True if the image became a view.");
  Record<ExplorationProgress>(m, "ExplorationProgress",
                              "Progress of an exploration, by its own knowledge.")
      .field("floor_m2", &ExplorationProgress::floor_m2,
             "Floor that was found, on which the robot has room.")
      .field("covered_m2", &ExplorationProgress::covered_m2,
             "Part of it in the catchment area of a view.")
      .field("position_deviation_m", &ExplorationProgress::position_deviation_m,
             "Standard deviation of the position, relative to the views around.")
      .field("is_complete", &ExplorationProgress::is_complete,
             "True if nothing is left to explore.");
  Record<RobotExplorer::Step>(m, "ExplorationStep", "The motion of a robot after an observation.")
      .field("decision", &RobotExplorer::Step::decision, "The latest decision.")
      .field("velocity", &RobotExplorer::Step::velocity, "Until the next observation.")
      .field("decided", &RobotExplorer::Step::decided,
             "True if this observation caused a decision; otherwise the motion continues.");
}

using SharedExplorer = Shared<RobotExplorer>;

void bind_explorer_properties(py::class_<SharedExplorer>& type) {
  type.def_property_readonly(
          "pose",
          [](const SharedExplorer& explorer) {
            return explorer.read([](const RobotExplorer& e) { return e.explorer().pose(); });
          },
          "Estimated pose at the last decision, in the frame of the first view.")
      .def_property_readonly(
          "views",
          [](const SharedExplorer& explorer) {
            return to_pose_rows(explorer.read([](const RobotExplorer& e) {
              const auto poses = e.explorer().view_poses();
              return std::vector<Pose2>(poses.begin(), poses.end());
            }));
          },
          "Estimated poses of the views, (n, 3) of x_m, y_m, heading_rad.")
      .def_property_readonly(
          "progress",
          [](const SharedExplorer& explorer) {
            return explorer.read([](const RobotExplorer& e) { return e.explorer().progress(); });
          },
          "Progress, by the knowledge of the robot.")
      .def_property_readonly(
          "travelled_m",
          [](const SharedExplorer& explorer) {
            return explorer.read([](const RobotExplorer& e) { return e.explorer().travelled_m(); });
          },
          "Length of the path by odometry.");
}

void bind_explorer(py::module_& m) {
  py::class_<SharedExplorer> type(
      m, "RobotExplorer",
      "Drives a robot that makes the memory of an unknown place by itself: "
      "takes an image with odometry, returns a velocity.");
  type.def(py::init([](const std::filesystem::path& memory, const PictureSource& source,
                       double robot_radius_m, bool has_ranges, const py::kwargs& keywords) {
             return std::make_unique<SharedExplorer>(
                 memory, source, read_explorer_options(robot_radius_m, has_ranges, keywords));
           }),
           py::arg("memory"), py::arg("source"), py::kw_only(), py::arg("robot_radius_m") = 0.2,
           py::arg("has_ranges") = false,
           append_option_list(
               "`memory`: a new file. `robot_radius_m`: radius around the camera that the robot "
               "needs. `has_ranges`: `step` gets ranges; without them, floor is assumed to be free "
               "until the robot touches an obstacle.",
               {options_of<ExplorationOptions>(), options_of<BaseOptions>(),
                options_of<OdometryNoise>("odometry"), options_of<SignatureOptions>(),
                options_of<PreprocessingOptions>()})
               .c_str())
      .def(
          "step",
          [](SharedExplorer& explorer, const py::object& observation,
             std::optional<double> contact_rad, const py::object& ranges, double max_range_m,
             double range_deviation_m) {
            const Observation seen = to_observation(observation);
            const auto measured = to_ranges(ranges, max_range_m, range_deviation_m);
            return explorer.change([&](RobotExplorer& e) {
              return e.step(seen, {contact_rad, measured});
            });
          },
          py::arg("observation"), py::arg("contact_rad") = py::none(),
          py::arg("ranges") = py::none(), py::kw_only(), py::arg("max_range_m") = 3.0,
          py::arg("range_deviation_m") = 0.02,
          "Call it for each image, which needs odometry; its true pose is not used. `contact_rad`: "
          "direction, in the robot frame, in which the robot touches an obstacle. `ranges`: (n, 2) "
          "of direction_rad, length_m; from `max_range_m` on there is no obstacle.")
      .def(
          "finish",
          [](SharedExplorer& explorer) {
            explorer.change([](RobotExplorer& e) {
              e.finish();
              return 0;
            });
          },
          "Writes all views and their map; call it at the end, also of an interrupted "
          "exploration.");
  bind_explorer_properties(type);
}

}  // namespace

void bind_navigation(py::module_& m) {
  Record<Velocity>(m, "Velocity", "Speeds of a robot in its own frame.")
      .field("forward_m_s", &Velocity::forward_m_s, "Along the heading, below 0 backwards.")
      .field("left_m_s", &Velocity::left_m_s, "0 for a differential drive.")
      .field("turn_rad_s", &Velocity::turn_rad_s, "Counter-clockwise.");
  Record<NavigationDecision>(m, "NavigationDecision", "One decision with its reasons.")
      .field("step", &NavigationDecision::step, "Number of the decision, from 1.")
      .field(
          "state", [](const NavigationDecision& d) { return to_string(d.state); },
          "'moving', 'arrived', 'blocked', 'lost' or 'unreachable'.")
      .field("direction_rad", &NavigationDecision::direction_rad, "In the current robot frame.")
      .field("advance_m", &NavigationDecision::advance_m, "Distance to drive; 0 unless moving.")
      .field("homing", &NavigationDecision::homing,
             "True on the last part, which follows the home vector to the goal.")
      .field("on_route", &NavigationDecision::on_route, "True on a recorded route.")
      .field("nearest", &NavigationDecision::nearest, "View nearest to the robot, or None.")
      .field("probability", &NavigationDecision::probability, "Probability of `nearest`.")
      .field("next", &NavigationDecision::next, "Next view of the path, or None.")
      .field("area", &NavigationDecision::area, "Index of the loaded area.")
      .field("difference", &NavigationDecision::difference,
             "Difference between the image and `nearest`, or the goal while homing.")
      .field("path_length", &NavigationDecision::path_length,
             "Remaining path length along the edges, in their unit.")
      .field("components", &NavigationDecision::components, "Number of compared components.")
      .field("bytes_read", &NavigationDecision::bytes_read,
             "Bytes of the loaded area's signatures and index that were read.")
      .field(
          "events",
          [](const NavigationDecision& d) {
            std::vector<std::string_view> names;
            for (const NavigationDecision::Event event : d.events)
              names.push_back(to_string(event));
            return names;
          },
          "Reasons for a decision other than to continue, such as 'kidnapped' or 'closed'.");
  Record<RobotNavigator::Step>(m, "NavigationStep", "The motion of a robot after an observation.")
      .field("decision", &RobotNavigator::Step::decision, "The latest decision.")
      .field("velocity", &RobotNavigator::Step::velocity, "For the next period of the base.")
      .field("decided", &RobotNavigator::Step::decided,
             "True if this observation caused a decision; otherwise the step continues.");
  using SharedNavigator = Shared<RobotNavigator>;
  const auto view_name = [](SharedNavigator& navigator, std::uint32_t view) {
    return navigator.change([&](RobotNavigator& n) { return n.info(ViewId{view}).name; });
  };
  py::class_<SharedNavigator>(m, "RobotNavigator",
                              "Drives a robot to a stored view: takes an image, returns a "
                              "velocity.")
      .def(py::init([](const std::filesystem::path& memory, const std::string& goal,
                       const std::optional<PictureSource>& source,
                       const std::optional<std::string>& edges,
                       const std::optional<std::string>& route, int threads,
                       const py::kwargs& keywords) {
             const auto options = make_navigator_options(edges, route, keywords);
             const py::gil_scoped_release free;
             InterruptibleExecutor executor(threads);
             return std::make_unique<SharedNavigator>(memory, goal, options, source,
                                                      &static_cast<Executor&>(executor));
           }),
           py::arg("memory"), py::arg("goal"), py::arg("source") = py::none(), py::kw_only(),
           py::arg("edges") = py::none(), py::arg("route") = py::none(), py::arg("threads") = 0,
           append_option_list(
               "`goal`: name or id of a view of the memory file. `edges`: 'map', "
               "'lattice', 'links' or 'arrangement' (computed now); None: the first that "
               "the memory has. `route`: a recorded route to follow on parts of the path "
               "that lie on it; only then the options route_* are allowed.",
               {options_of<NavigatorOptions>(), options_of<PlannerOptions>(),
                options_of<BaseOptions>(), options_of<KnownRouteOptions>("route")})
               .c_str())
      .def(
          "step",
          [](SharedNavigator& navigator, const py::object& observation, bool obstacle,
             std::optional<std::uint32_t> estimate) {
            const Observation seen = to_observation(observation);
            return navigator.change([&](RobotNavigator& n) {
              RobotReport report{.obstacle = obstacle};
              if (estimate) report.estimate = ViewId{*estimate};
              return n.step(seen, report);
            });
          },
          py::arg("observation"), py::arg("obstacle") = false, py::arg("estimate") = py::none(),
          "Call it once in each period of the base (period_s). `obstacle`: an obstacle stopped "
          "the robot. `estimate`: the robot's view by another, certain estimate. "
          "A step ends by the observation's odometry, or without it by time.")
      .def(
          "set_goal",
          [](SharedNavigator& navigator, const std::string& goal) {
            navigator.change([&](RobotNavigator& n) {
              n.set_goal(goal);
              return 0;
            });
          },
          py::arg("goal"), "Sets another goal; the estimated position is kept.")
      .def("name_of", view_name, py::arg("view"), "Returns the name of a view.")
      .def_property_readonly(
          "goal",
          [](SharedNavigator& navigator) {
            return navigator.change([](RobotNavigator& n) { return n.info(n.goal()).name; });
          },
          "Name of the goal's view.")
      .def_property_readonly(
          "edges_from",
          [](const SharedNavigator& navigator) {
            return navigator.read([](const RobotNavigator& n) { return to_string(n.origin()); });
          },
          "'map', 'lattice', 'links' or 'arrangement'.")
      .def_property_readonly(
          "edges",
          [](const SharedNavigator& navigator) {
            return navigator.read([](const RobotNavigator& n) {
              std::vector<std::pair<ViewId, ViewId>> edges;
              for (const NavigationGraph::Edge& edge : n.graph().edges()) {
                edges.emplace_back(edge.a, edge.b);
              }
              return edges;
            });
          },
          "Edges as pairs of views.");
  bind_exploration_records(m);
  bind_explorer(m);
}

}  // namespace panonav::python
