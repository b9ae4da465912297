#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_simulation/memory_mission.hpp"
#include "panonav_viewer/mission_picture.hpp"
#include "reports/navigate_report.hpp"
#include "reports/report_page.hpp"
#include "runs/mission_moments.hpp"
#include "runs/run_record.hpp"
#include "runs/simulated_recording.hpp"

namespace panonav::command {

namespace {

struct NavigateArguments {
  std::string memory;
  std::string goal;
  std::string scene;
  std::optional<std::string> start;
  std::optional<std::string> kidnap;
  std::optional<std::string> edges;
  std::optional<std::string> route;
  std::optional<std::string> obstacles;
  std::optional<std::string> log;
  std::optional<std::string> picture;
  std::optional<std::string> report;
  RunRecordArguments record;
  simulation::SimulatedWorldOptions simulation;
  simulation::MissionOptions mission;
  KnownRouteOptions known_route;
};

/// Returns the name of the view as JSON; null if there is no view.
ordered_json view_name_or_null(const std::optional<ViewId>& view, const RobotNavigator& robot) {
  return view ? ordered_json(robot.info(*view).name) : ordered_json();
}

ordered_json to_json(const NavigationDecision& decision, const Pose2& pose,
                     const RobotNavigator& robot) {
  auto events = ordered_json::array();
  for (const NavigationDecision::Event event : decision.events) events.push_back(to_string(event));
  return {{"step", decision.step},
          {"state", to_string(decision.state)},
          {"direction_rad", decision.direction_rad},
          {"advance_m", decision.advance_m},
          {"homing", decision.homing},
          {"on_route", decision.on_route},
          {"nearest", view_name_or_null(decision.nearest, robot)},
          {"probability", decision.probability},
          {"next", view_name_or_null(decision.next, robot)},
          {"area", decision.area},
          {"image_difference", decision.difference},
          {"path_left", to_json_or_null(decision.path_length)},
          {"components", decision.components},
          {"bytes_read", decision.bytes_read},
          {"events", std::move(events)},
          {"pose", pose_json(pose)}};
}

std::string describe_event(NavigationDecision::Event event) {
  switch (event) {
    case NavigationDecision::Event::relocalised:
      return "searches for its position in the whole memory";
    case NavigationDecision::Event::kidnapped:
      return "is not at the expected place";
    case NavigationDecision::Event::entered_area:
      return "enters an area";
    case NavigationDecision::Event::unknown_place:
      return "does not recognise the place";
    case NavigationDecision::Event::obstructed:
      return "was stopped by an obstacle";
    case NavigationDecision::Event::closed:
      return "marks an edge as blocked and plans again";
    case NavigationDecision::Event::reopened:
      return "tries blocked edges again";
    case NavigationDecision::Event::homing:
      return "drives home to the goal's view";
    case NavigationDecision::Event::homing_failed:
      return "drove home to another place";
    case NavigationDecision::Event::crossing:
      return "drives home to a view of another part of the arrangement";
    case NavigationDecision::Event::route:
      return "follows the recorded route";
    case NavigationDecision::Event::route_left:
      return "leaves the recorded route early";
  }
  return std::string(to_string(event));
}

std::string format_line(const NavigationDecision& decision, const RobotNavigator& robot) {
  std::string line = "step " + std::to_string(decision.step) + "  ";
  if (decision.nearest) {
    line += "at " + robot.info(*decision.nearest).name + " (probability " +
            format_fixed(decision.probability, 2) + ")  ";
  }
  for (std::size_t i = 0; i < decision.events.size(); ++i) {
    line += (i > 0 ? ", " : "") + describe_event(decision.events[i]);
    if (decision.events[i] == NavigationDecision::Event::entered_area) {
      line += " (" + std::to_string(decision.area) + ")";
    }
  }
  return line;
}

std::string_view explain_end(NavigationDecision::State state) {
  switch (state) {
    case NavigationDecision::State::arrived:
      return "the image matches the goal's view";
    case NavigationDecision::State::blocked:
      return "the robot is stuck, but the memory has a path";
    case NavigationDecision::State::lost:
      return "the image matches no view of the memory, or a view of another place";
    case NavigationDecision::State::unreachable:
      return "the memory has no path to the goal, or all paths are blocked";
    case NavigationDecision::State::moving:
      break;
  }
  return "";
}

/// Returns why the run cannot reach a goal on another floor; empty if it ended otherwise.
std::string explain_other_floor(const simulation::MissionRun& run, const RobotNavigator& robot) {
  const auto& nearest = run.decisions.back().nearest;
  const bool is_unreachable = run.end == NavigationDecision::State::unreachable;
  return is_unreachable && nearest ? robot.explain_other_floor(*nearest) : std::string();
}

/// Sets the distances to the goal to infinity if it is on another floor.
void clear_distances_between_floors(simulation::MissionRun& run, const RobotNavigator& robot) {
  if (explain_other_floor(run, robot).empty()) return;
  run.end_distance_m = std::numeric_limits<double>::infinity();
  run.shortest_m = std::numeric_limits<double>::infinity();
}

/// Explains the end of a run in one line.
std::string explain_end(const simulation::MissionRun& run, const RobotNavigator& robot) {
  const std::string other_floor = explain_other_floor(run, robot);
  return other_floor.empty() ? std::string(explain_end(run.end)) : other_floor;
}

/// Returns the number of edges between components of the arrangement.
std::size_t count_crossings(const RobotNavigator& robot) {
  return static_cast<std::size_t>(
      std::ranges::count_if(robot.graph().edges(), &NavigationGraph::Edge::is_crossing));
}

ordered_json summary_json(const NavigateArguments& arguments, RobotNavigator& robot,
                          const std::string& goal, const Pose2& start,
                          const simulation::MissionRun& run) {
  const NavigationGraph& graph = robot.graph();
  const AreaPlanner& planner = robot.navigator().planner();
  return {{"memory", arguments.memory},
          {"goal", goal},
          {"scene", arguments.scene},
          {"edges_from", to_string(robot.origin())},
          {"route", to_json_or_null(arguments.route)},
          {"views", graph.size()},
          {"edges", graph.edges().size()},
          {"crossings", count_crossings(robot)},
          {"areas", planner.areas().nodes.size()},
          {"end", to_string(run.end)},
          {"reason", explain_end(run, robot)},
          {"steps", run.decisions.size()},
          {"closed_edges", planner.blocked_edge_count()},
          {"start", pose_json(start)},
          {"pose", pose_json(run.path.back())},
          {"goal_distance_m", to_json_or_null(run.end_distance_m)},
          {"travelled_m", run.travelled_m},
          {"shortest_m", to_json_or_null(run.shortest_m)},
          {"kidnapped_after_step",
           run.kidnapped_at ? ordered_json(*run.kidnapped_at + 1) : ordered_json()}};
}

void print_summary(const simulation::MissionRun& run, const RobotNavigator& robot,
                   Session& session) {
  const std::string name(to_string(run.end));
  session.print(
      (run.end == NavigationDecision::State::arrived ? session.green(name) : session.red(name)) +
      " after " + format_count(run.decisions.size(), "step") + ": " + explain_end(run, robot));
  if (std::isfinite(run.end_distance_m)) {
    session.print("distance from the goal's view: " +
                  session.bold(format_fixed(run.end_distance_m, 3) + " m"));
  }
  std::string distances = "driven " + format_fixed(run.travelled_m, 2) + " m";
  if (std::isfinite(run.shortest_m)) {
    distances += "; the shortest path is " + format_fixed(run.shortest_m, 2) + " m long";
  }
  session.print(distances);
  const auto sure = std::ranges::count_if(run.decisions, [](const NavigationDecision& decision) {
    return decision.probability >= 0.5;
  });
  session.print("certain of its position (probability 0.5 or more) in " + std::to_string(sure) +
                " of " + format_count(run.decisions.size(), "step"));
  if (run.kidnapped_at) {
    session.print("kidnapped after step " + std::to_string(*run.kidnapped_at + 1));
  }
}

void write_log(const std::string& path, const simulation::MissionRun& run) {
  std::string text;
  for (const NavigationDecision& decision : run.decisions) text += describe(decision) + "\n";
  write_file(path, text);
}

/// Returns the start of the run and the pose to which the robot is kidnapped.
simulation::Mission make_mission(const NavigateArguments& arguments, ViewId goal,
                                 const simulation::MissionPlace& place, std::uint64_t seed) {
  constexpr std::uint64_t stream_of_starts = 4;
  Random random(seed, stream_of_starts);
  simulation::Mission mission{goal, place.free_space->random_pose(random), std::nullopt};
  if (arguments.start)
    mission.start = parse_free_pose("--start", *arguments.start, *place.free_space);
  if (arguments.kidnap)
    mission.kidnapped_to = parse_free_pose("--kidnap", *arguments.kidnap, *place.free_space);
  return mission;
}

// Writes the requested log, picture and report.
void write_results(const NavigateArguments& arguments, const simulation::MissionPlace& place,
                   const simulation::RememberedPlace& remembered, const RobotNavigator& robot,
                   const simulation::MissionRun& run, const viewer::RunPage& replay_page) {
  const ViewId goal = robot.goal();
  const std::string goal_file = robot.info(goal).name;
  if (arguments.log) write_log(*arguments.log, run);
  if (arguments.picture) {
    viewer::write_mission_picture(
        *arguments.picture,
        "to " + goal_file + " in " + place.scene.name + ": " + std::string(to_string(run.end)),
        place, remembered, arguments.mission.planner, goal, run);
  }
  if (arguments.report) {
    write_navigate_report(
        *arguments.report,
        {goal_file, explain_end(run, robot), run,
         viewer::make_mission_plot("", place, remembered, arguments.mission.planner, goal, run)},
        replay_page);
  }
}

void print_graph(const RobotNavigator& robot, Session& session) {
  session.print(format_count(robot.graph().size(), "view") + ", " +
                format_count(robot.graph().edges().size(), "edge") + " from " +
                (robot.origin() == RobotNavigatorOptions::GraphOrigin::arrangement
                     ? "a new arrangement (panonav arrange can store one)"
                     : "the memory's " + std::string(to_string(robot.origin()))));
  if (const std::size_t crossings = count_crossings(robot); crossings > 0) {
    session.print(format_count(crossings, "edge") +
                  " lead from one part of the arrangement to another; the robot crosses by homing");
  }
}

/// Throws FileError if the goal's position is unknown. --kidnap needs it to find the middle of the
/// path.
void require_known_goal(const NavigateArguments& arguments, const RobotNavigator& robot,
                        const simulation::RememberedPlace& remembered) {
  if (!std::isfinite(remembered.truth[*remembered.graph.node_of(robot.goal())].x_m)) {
    throw FileError(arguments.memory,
                    "does not contain the true position of the view " +
                        robot.info(robot.goal()).name +
                        ", so the middle of the path is unknown; leave out --kidnap");
  }
}

void print_decision(const NavigationDecision& decision, const Pose2& pose,
                    const RobotNavigator& robot, Session& session) {
  if (session.json()) {
    session.print(json_line(to_json(decision, pose, robot)));
  } else if (!decision.events.empty()) {
    session.print(format_line(decision, robot));
  }
}

ExitCode navigate(const Arguments& declared, const NavigateArguments& arguments, Session& session) {
  if (declared.is_set("odometry", "drive")) {
    throw UsageError(
        "--odometry-drive: the drive of the robot is set with --drive; leave out --odometry-drive");
  }
  RobotNavigatorOptions options{.navigator = arguments.mission.navigator,
                                .planner = arguments.mission.planner,
                                .base = arguments.mission.base,
                                .route = arguments.route,
                                .known_route = arguments.known_route};
  if (arguments.edges) options.edges = parse_graph_origin(*arguments.edges);
  RobotNavigator robot(arguments.memory, arguments.goal, options, std::nullopt,
                       &session.executor());
  if (robot.memory().header().source.kind != PictureKind::mirror) {
    declared.reject_options({"--vignetting"}, "on the panoramas of this memory");
  }
  const simulation::RememberedPlace remembered = simulation::make_remembered_place(robot);
  if (arguments.kidnap) require_known_goal(arguments, robot, remembered);
  if (arguments.report) prepare_report_folder(*arguments.report, "navigate");
  viewer::RunPage replay_page("", 100);
  RunRecord record(arguments.record, std::span(&arguments.memory, 1), false, session,
                   {.memory = arguments.memory, .takes = viewer::ViewerInput::goal});
  if (arguments.report) record.copy_to(replay_page);
  MissionMoments moments(robot, remembered, arguments.mission.planner.field);
  simulation::ImageReport report;
  if (record.is_active()) {
    report = [&](const Image& image, const Panorama& panorama) {
      moments.set_image(image, panorama);
    };
  }
  simulation::MissionPlace place =
      simulation::make_mission_place(arguments.scene, arguments.simulation, robot,
                                     make_option_lookup(declared), session.executor(), report);
  for (const auto& warning : place.scene.warnings) session.note("warning: " + warning);
  const auto seed = static_cast<std::uint64_t>(arguments.simulation.simulation.scene.seed);
  const simulation::Mission mission = make_mission(arguments, robot.goal(), place, seed);
  if (!session.json()) print_graph(robot, session);
  simulation::MissionOptions mission_options = arguments.mission;
  if (arguments.obstacles == "ranges")
    mission_options.obstacles = simulation::ObstacleSensor::ranges;
  if (arguments.obstacles == "camera") {
    mission_options.obstacles = simulation::ObstacleSensor::camera;
    simulation::add_floor_camera(place, place.sensor);
  }
  simulation::MissionRun run = simulation::run_mission(
      place, remembered, robot.navigator(), mission, mission_options, seed,
      [&](const NavigationDecision& decision, const Pose2& pose) {
        if (record.is_active()) {
          record.add(moments.make(decision, pose, place.scene));
          moments.restart_clock();
        }
        print_decision(decision, pose, robot, session);
      },
      [&] { return set_goal_of_viewer(robot, remembered, record, session); });
  record.close();
  clear_distances_between_floors(run, robot);
  const std::string goal_file = robot.info(robot.goal()).name;  // may have changed in the viewer
  write_results(arguments, place, remembered, robot, run, replay_page);
  if (session.json()) {
    session.print(json_line(summary_json(arguments, robot, goal_file, mission.start, run)));
  } else {
    print_summary(run, robot, session);
    if (arguments.report) print_report_path(*arguments.report, session);
  }
  return run.end == NavigationDecision::State::arrived ? ExitCode::done : ExitCode::no_answer;
}

Run declare_navigate(Arguments& arguments) {
  auto values = std::make_shared<NavigateArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file of a simulated data set");
  arguments.required_option("--goal VIEW", values->goal, "Name or id of the goal view");
  arguments.required_option("--scene SCENE", values->scene,
                            "Scene of the robot, as in panonav simulate");
  arguments.option("--start X,Y,DEG", values->start,
                   "Start position in metres and heading in degrees; default: a random pose that "
                   "is free of obstacles");
  arguments.option("--kidnap X,Y,DEG", values->kidnap,
                   "Move the robot to this pose in the middle of its path, without odometry");
  arguments.choice(
      "--edges", values->edges, {"map", "lattice", "links", "arrangement"},
      "Source of the edges between views: map of the verb map; lattice of the verb arrange; links "
      "of the memory; or a new arrangement (default: the first that exists)");
  arguments.option("--route NAME", values->route,
                   "Follow this recorded route where the planned path lies on it; the poses of the "
                   "views and of the route must be from the same data set");
  arguments.choice(
      "--obstacles", values->obstacles, {"bumper", "ranges", "camera"},
      "Sensor of the robot for obstacles: a bumper that feels contact and its side; in addition, "
      "eight noisy ranges or the floor in the pictures of its camera (default: bumper)");
  arguments.option("--log FILE", values->log,
                   "Write the decisions of the robot into this file, one per line");
  arguments.option("--picture FILE", values->picture,
                   "Draw the directions to the goal, the planned path and the driven path into "
                   "this PNG or SVG file");
  declare_report(arguments, values->report, "a page that replays the drive");
  declare_record(arguments, values->record);
  declare_view(arguments, values->record);
  arguments.hide_from_help({"--obstacles", "--record", "--view", "--picture"});
  arguments.options("simulation", values->simulation.simulation.scene);
  arguments.options("navigator", values->mission.navigator);
  arguments.options("planner", values->mission.planner);
  arguments.options("known_route", values->known_route, "route");
  arguments.options("base", values->mission.base);
  arguments.options("odometry", values->mission.motion, "odometry");
  arguments.options("frame", values->simulation.frame);
  arguments.options("sensor", values->simulation.sensor);
  arguments.options("free_space", values->simulation.free_space);
  arguments.show_in_help({"--seed", "--light"});
  reject_ineffective_options(arguments, values->simulation);
  arguments.reject_options_unless(
      {"[known_route]"}, [values] { return values->route.has_value(); }, "without --route");
  arguments.reject_options_unless(
      {"--route-coarse-deg"}, [values] { return values->known_route.fit.levels > 1; },
      "with --route-levels 1");
  const auto& homing = values->mission.navigator.homing;
  arguments.reject_options_unless(
      {"--coarse", "--middle"},
      [&homing] { return homing.strategy != HomingPursuitOptions::Strategy::steady; },
      "with --strategy steady");
  arguments.reject_options_unless(
      {"--fine"},
      [&homing] { return homing.strategy == HomingPursuitOptions::Strategy::coarse_to_fine; },
      "without --strategy coarse_to_fine");
  arguments.declare_outputs({"--log", "--picture"});
  return [values, &arguments](Session& session) { return navigate(arguments, *values, session); };
}

}  // namespace

Verb navigate_verb() {
  return {"navigate",
          VerbGroup::experiments,
          "Drive a simulated robot to a stored view by images",
          "The simulated robot uses the same camera as the views of the memory. Poses in the "
          "memory are only used to measure the final distance from the goal, and to find the views "
          "on the route of --route. The exit code is 1 if the robot does not arrive because its "
          "path is blocked, it is lost, or there is no path.",
          "  panonav navigate office.panonav --goal view_00012.png --scene office --report "
          "mission\n"
          "  panonav navigate office.panonav --goal 3 --scene office --light 0.7 --moved-objects "
          "0.1 --json\n"
          "  panonav navigate drive.panonav --goal 60 --scene loop --route route",
          declare_navigate};
}

}  // namespace panonav::command
