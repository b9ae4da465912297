#include "memories.hpp"
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
}

}  // namespace panonav::python
