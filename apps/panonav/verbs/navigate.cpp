#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
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
  std::optional<std::string> log;
  std::optional<std::string> picture;
  std::optional<std::string> report;
  RunRecordArguments record;
  simulation::SimulatedWorldOptions simulation;
  simulation::MissionOptions mission;
  KnownRouteOptions known_route;
};

/// "X,Y,HEADING_DEG".
Pose2 pose_from_text(const std::string& flag, const std::string& text) {
  const std::size_t first = text.find(',');
  const std::size_t second = first == std::string::npos ? first : text.find(',', first + 1);
  if (second == std::string::npos) {
    throw UsageError(flag + " is '" + text +
                     "'; allowed: X,Y,HEADING_DEG in metres, metres and degrees");
  }
  return {number_from_text(flag, text.substr(0, first)),
          number_from_text(flag, text.substr(first + 1, second - first - 1)),
          wrap_angle(radians(number_from_text(flag, text.substr(second + 1))))};
}

Pose2 free_pose(const std::string& flag, const std::string& text,
                const simulation::FreeSpace& space) {
  const Pose2 pose = pose_from_text(flag, text);
  if (!space.is_free(pose.position())) {
    throw UsageError(
        flag + " is at x " + format_number(pose.x_m) + " m, y " + format_number(pose.y_m) +
        " m, where the robot cannot stand; allowed: free places between x " +
        format_number(space.low().x_m) + " to " + format_number(space.high().x_m) + " m and y " +
        format_number(space.low().y_m) + " to " + format_number(space.high().y_m) + " m");
  }
  return pose;
}

/// null where nobody knows.
ordered_json file_or_null(const std::optional<ViewId>& view, const RobotNavigator& robot) {
  return view ? ordered_json(robot.info(*view).name) : ordered_json();
}

ordered_json as_json(const NavigationDecision& decision, const Pose2& pose,
                     const RobotNavigator& robot) {
  auto events = ordered_json::array();
  for (const NavigationEvent event : decision.events) events.push_back(name_of(event));
  return {{"step", decision.step},
          {"state", name_of(decision.state)},
          {"direction_rad", decision.direction_rad},
          {"advance_m", decision.advance_m},
          {"homing", decision.homing},
          {"on_route", decision.on_route},
          {"nearest", file_or_null(decision.nearest, robot)},
          {"probability", decision.probability},
          {"next", file_or_null(decision.next, robot)},
          {"area", decision.area},
          {"image_difference", decision.difference},
          {"way", or_null(decision.path_length)},
          {"components", decision.components},
          {"bytes_read", decision.bytes_read},
          {"events", std::move(events)},
          {"pose", pose_json(pose)}};
}

std::string in_words(NavigationEvent event) {
  switch (event) {
    case NavigationEvent::relocalised:
      return "looks for its place in the whole memory";
    case NavigationEvent::kidnapped:
      return "finds itself at another place than expected";
    case NavigationEvent::entered_area:
      return "enters an area";
    case NavigationEvent::unknown_place:
      return "does not know this place";
    case NavigationEvent::obstructed:
      return "was stopped by something in its way";
    case NavigationEvent::closed:
      return "takes an edge for blocked and plans anew";
    case NavigationEvent::reopened:
      return "tries blocked edges again";
    case NavigationEvent::homing:
      return "goes home to the goal's view";
    case NavigationEvent::homing_failed:
      return "came home to another place";
    case NavigationEvent::route:
      return "follows the recorded route";
    case NavigationEvent::route_left:
      return "leaves the recorded route before the end of its leg";
  }
  return std::string(name_of(event));
}

std::string as_text(const NavigationDecision& decision, const RobotNavigator& robot) {
  std::string line = "step " + std::to_string(decision.step) + "  ";
  if (decision.nearest) {
    line += "at " + robot.info(*decision.nearest).name + " (probability " +
            format_fixed(decision.probability, 2) + ")  ";
  }
  for (std::size_t i = 0; i < decision.events.size(); ++i) {
    line += (i > 0 ? ", " : "") + in_words(decision.events[i]);
    if (decision.events[i] == NavigationEvent::entered_area) {
      line += " (" + std::to_string(decision.area) + ")";
    }
  }
  return line;
}

std::string_view reason_of(NavigationState state) {
  switch (state) {
    case NavigationState::arrived:
      return "what the robot sees is the goal's view";
    case NavigationState::blocked:
      return "the robot cannot get on, though the memory has a way";
    case NavigationState::lost:
      return "what the robot sees is nowhere in the memory, or not where it should be";
    case NavigationState::unreachable:
      return "no way in the memory leads to the goal, or all of them are blocked";
    case NavigationState::moving:
      break;
  }
  return "";
}

ordered_json summary_json(const NavigateArguments& wanted, RobotNavigator& robot,
                          const std::string& goal, const Pose2& start,
                          const simulation::MissionRun& run) {
  const NavigationGraph& graph = robot.graph();
  const AreaPlanner& planner = robot.navigator().planner();
  return {{"memory", wanted.memory},
          {"goal", goal},
          {"scene", wanted.scene},
          {"edges_from", name_of(robot.origin())},
          {"route", or_null(wanted.route)},
          {"views", graph.size()},
          {"edges", graph.edges().size()},
          {"areas", planner.areas().nodes.size()},
          {"end", name_of(run.end)},
          {"reason", reason_of(run.end)},
          {"steps", run.decisions.size()},
          {"closed_edges", planner.blocked_edges()},
          {"start", pose_json(start)},
          {"pose", pose_json(run.path.back())},
          {"goal_distance_m", or_null(run.end_distance_m)},
          {"travelled_m", run.travelled_m},
          {"shortest_m", or_null(run.shortest_m)},
          {"kidnapped_after_step",
           run.kidnapped_at ? ordered_json(*run.kidnapped_at + 1) : ordered_json()}};
}

void print_summary(const simulation::MissionRun& run, Session& session) {
  const std::string name(name_of(run.end));
  session.print((run.end == NavigationState::arrived ? session.good(name) : session.bad(name)) +
                " after " + std::to_string(run.decisions.size()) +
                " steps: " + std::string(reason_of(run.end)));
  if (std::isfinite(run.end_distance_m)) {
    session.print("from where the goal's view was taken: " +
                  session.strong(format_fixed(run.end_distance_m, 3) + " m"));
  }
  std::string way = "driven " + format_fixed(run.travelled_m, 2) + " m";
  if (std::isfinite(run.shortest_m)) {
    way += "; the shortest way is " + format_fixed(run.shortest_m, 2) + " m long";
  }
  session.print(way);
  const auto sure = std::ranges::count_if(run.decisions, [](const NavigationDecision& decision) {
    return decision.probability >= 0.5;
  });
  session.print("sure of its place, with a probability of 0.5 or more, in " + std::to_string(sure) +
                " of " + std::to_string(run.decisions.size()) + " steps");
  if (run.kidnapped_at) {
    session.print("kidnapped after step " + std::to_string(*run.kidnapped_at + 1));
  }
}

void write_log(const std::string& path, const simulation::MissionRun& run) {
  std::string text;
  for (const NavigationDecision& decision : run.decisions) text += describe(decision) + "\n";
  write_file(path, text);
}

/// Where the run begins, who is kidnapped to where.
simulation::Mission mission_of(const NavigateArguments& wanted, ViewId goal,
                               const simulation::MissionPlace& place, std::uint64_t seed) {
  constexpr std::uint64_t stream_of_starts = 4;
  Random random(seed, stream_of_starts);
  simulation::Mission mission{goal, place.free_space->random_pose(random), std::nullopt};
  if (wanted.start) mission.start = free_pose("--start", *wanted.start, *place.free_space);
  if (wanted.kidnap)
    mission.kidnapped_to = free_pose("--kidnap", *wanted.kidnap, *place.free_space);
  return mission;
}

// Writes the log, the picture and the report that were asked for.
void write_results(const NavigateArguments& wanted, const simulation::MissionPlace& place,
                   const simulation::RememberedPlace& remembered, ViewId goal,
                   const std::string& goal_file, const simulation::MissionRun& run,
                   const viewer::RunPage& played) {
  if (wanted.log) write_log(*wanted.log, run);
  if (wanted.picture) {
    viewer::write_mission_picture(
        *wanted.picture,
        "to " + goal_file + " in " + place.scene.name + ": " + std::string(name_of(run.end)), place,
        remembered, wanted.mission.planner, goal, run);
  }
  if (wanted.report) {
    write_navigate_report(
        *wanted.report,
        {goal_file, std::string(reason_of(run.end)), run,
         viewer::mission_plot("", place, remembered, wanted.mission.planner, goal, run)},
        played);
  }
}

void print_graph(const RobotNavigator& robot, Session& session) {
  session.print(std::to_string(robot.graph().size()) + " views, " +
                std::to_string(robot.graph().edges().size()) + " edges from " +
                (robot.origin() == GraphOrigin::arrangement
                     ? "an arrangement made now (panonav arrange would keep one)"
                     : "the memory's " + std::string(name_of(robot.origin()))));
}

/// A robot is carried away half of its way to the goal, so that the way must be known.
void require_known_goal(const NavigateArguments& wanted, const RobotNavigator& robot,
                        const simulation::RememberedPlace& remembered) {
  if (!std::isfinite(remembered.truth[*remembered.graph.node_of(robot.goal())].x_m)) {
    throw FileError(wanted.memory, "does not know where the view " + robot.info(robot.goal()).name +
                                       " was taken, so half of the way neither; leave out "
                                       "--kidnap");
  }
}

ExitCode navigate(const Arguments& arguments, const NavigateArguments& wanted, Session& session) {
  if (arguments.given("odometry", "drive")) {
    throw UsageError("--odometry-drive: the robot's drive is --drive here; leave it out");
  }
  RobotNavigatorOptions options{.navigator = wanted.mission.navigator,
                                .planner = wanted.mission.planner,
                                .base = wanted.mission.base,
                                .route = wanted.route,
                                .known_route = wanted.known_route};
  if (wanted.edges) options.edges = find_graph_origin(*wanted.edges);
  RobotNavigator robot(wanted.memory, wanted.goal, options, std::nullopt, &session.executor());
  if (robot.memory().header().source.kind != PictureKind::mirror) {
    arguments.refuse_unused({"--vignetting"}, "on the panoramas of this memory");
  }
  const simulation::RememberedPlace remembered = simulation::make_remembered_place(robot);
  if (wanted.kidnap) require_known_goal(wanted, robot, remembered);
  if (wanted.report) prepare_report_folder(*wanted.report, "navigate");
  viewer::RunPage played("", 100);
  RunRecord record(wanted.record, std::span(&wanted.memory, 1), false, session,
                   {.memory = wanted.memory, .takes = viewer::ViewWish::goal});
  if (wanted.report) record.also_into(played);
  MissionMoments moments(robot, remembered, wanted.mission.planner.field);
  simulation::ImageReport report;
  if (record.wanted()) {
    report = [&](const Image& image, const Panorama& panorama) {
      moments.set_image(image, panorama);
    };
  }
  const simulation::MissionPlace place = simulation::make_mission_place(
      wanted.scene, wanted.simulation, robot, typed_options(arguments), session.executor(), report);
  for (const auto& warning : place.scene.warnings) session.note("warning: " + warning);
  const auto seed = static_cast<std::uint64_t>(wanted.simulation.simulation.scene.seed);
  const simulation::Mission mission = mission_of(wanted, robot.goal(), place, seed);
  if (!session.json()) {
    print_graph(robot, session);
  }
  const simulation::MissionRun run = simulation::run_mission(
      place, remembered, robot.navigator(), mission, wanted.mission, seed,
      [&](const NavigationDecision& decision, const Pose2& pose) {
        if (record.wanted()) {
          record.add(moments.make(decision, pose, place.scene));
          moments.restart_clock();
        }
        if (session.json()) {
          session.print(json_line(as_json(decision, pose, robot)));
        } else if (!decision.events.empty()) {
          session.print(as_text(decision, robot));
        }
      },
      [&] { return set_goal_of_viewer(robot, remembered, record, session); });
  record.close();
  const std::string goal_file = robot.info(robot.goal()).name;  // a viewer may have changed it
  write_results(wanted, place, remembered, robot.goal(), goal_file, run, played);
  if (session.json()) {
    session.print(json_line(summary_json(wanted, robot, goal_file, mission.start, run)));
  } else {
    print_summary(run, session);
    if (wanted.report) tell_report(*wanted.report, session);
  }
  return run.end == NavigationState::arrived ? ExitCode::done : ExitCode::no_answer;
}

Run declare_navigate(Arguments& arguments) {
  auto wanted = std::make_shared<NavigateArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file of a simulated data set");
  arguments.required_option("--goal VIEW", wanted->goal, "Name or id of the view to go to");
  arguments.required_option("--scene SCENE", wanted->scene,
                            "Where the robot is: a scene as of panonav simulate");
  arguments.option("--start X,Y,DEG", wanted->start,
                   "Place where the robot starts, with its heading in degrees; otherwise a free "
                   "place at random");
  arguments.option("--kidnap X,Y,DEG", wanted->kidnap,
                   "Carry the robot to this place once half of the way is driven");
  arguments.choice("--edges", wanted->edges, {"map", "lattice", "links", "arrangement"},
                   "What to plan over: a stored map, the memory's links, or an arrangement made "
                   "now (default: the first that is there)");
  arguments.option("--route NAME", wanted->route,
                   "Go along this recorded route of the memory where the way leads along it; views "
                   "and route have the poses of one data set");
  arguments.option("--log FILE", wanted->log,
                   "Write each decision as a line of text into this file");
  arguments.option("--picture FILE", wanted->picture,
                   "Draw the directions to the goal, the way planned and the way driven into this "
                   "PNG or SVG file");
  arguments.option("--report FOLDER", wanted->report,
                   "Write a page that plays the mission with its decisions into this folder: a new "
                   "one, or that of an earlier report");
  declare_record(arguments, wanted->record);
  declare_view(arguments, wanted->record);
  arguments.uncommon({"--record", "--view", "--picture"});
  arguments.options("simulation", wanted->simulation.simulation.scene);
  arguments.options("navigator", wanted->mission.navigator);
  arguments.options("planner", wanted->mission.planner);
  arguments.options("known_route", wanted->known_route, "route");
  arguments.options("base", wanted->mission.base);
  arguments.options("odometry", wanted->mission.motion, "odometry");
  arguments.options("frame", wanted->simulation.frame);
  arguments.options("sensor", wanted->simulation.sensor);
  arguments.options("free_space", wanted->simulation.free_space);
  arguments.common({"--seed", "--light"});
  require_effects(arguments, wanted->simulation);
  arguments.used_only(
      {"[known_route]"}, [wanted] { return wanted->route.has_value(); }, "without --route");
  arguments.used_only(
      {"--route-coarse-deg"}, [wanted] { return wanted->known_route.fit.levels > 1; },
      "with --route-levels 1");
  const auto& homing = wanted->mission.navigator.homing;
  arguments.used_only(
      {"--coarse", "--middle"},
      [&homing] { return homing.strategy != HomingPursuitOptions::Strategy::steady; },
      "with --strategy steady");
  arguments.used_only(
      {"--fine"},
      [&homing] { return homing.strategy == HomingPursuitOptions::Strategy::coarse_to_fine; },
      "without --strategy coarse_to_fine");
  return [wanted, &arguments](Session& session) { return navigate(arguments, *wanted, session); };
}

}  // namespace

Verb navigate_verb() {
  return {"navigate", "Send a simulated robot to a remembered view, by what it sees alone",
          "The robot sees as the memory's views were seen. Poses in the memory only say how far "
          "from the goal it ended, and which views lie beside a --route. The exit code is 1 unless "
          "the robot arrives: blocked, lost or unreachable.",
          "  panonav navigate office.panonav --goal view_00012.png --scene office --report "
          "mission\n"
          "  panonav navigate office.panonav --goal 3 --scene office --light 0.7 --moved-objects "
          "0.1 --json\n"
          "  panonav navigate drive.panonav --goal 60 --scene loop --route route",
          declare_navigate};
}

}  // namespace panonav::command
