#include "demo/navigation.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/navigation/direction_field.hpp"
#include "panonav/navigation/navigation_graph.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav_simulation/memory_mission.hpp"
#include "panonav_simulation/screen.hpp"
#include "panonav_viewer/mission_picture.hpp"
#include "panonav_viewer/plot.hpp"
#include "panonav_viewer/scene_drawing.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

namespace {

// Random streams of the demonstration's missions.
constexpr std::uint64_t mission_stream = 1;
constexpr std::uint64_t kidnapped_stream = 2;
constexpr std::uint64_t screen_stream = 3;
constexpr std::uint64_t noise_stream = 4;

using SharedEncoder = std::shared_ptr<const ViewEncoder>;

simulation::RememberedPlace make_remembered_office(const VisualMemory& memory,
                                                   const Lattice& arranged, double spacing_m) {
  simulation::RememberedPlace remembered{memory, graph_from_lattice(arranged), {}, spacing_m};
  for (const ViewId view : remembered.graph.views()) {
    const ReferencePose& pose = *memory.info(view).pose;
    remembered.truth.push_back({pose.x_m, pose.y_m, *pose.heading_rad});
  }
  return remembered;
}

/// Sets the robot's camera: images are rendered with the true camera and unwarped with the
/// calibrated one.
void set_robot_camera(simulation::MissionPlace& place, const DemoRecordings& recordings,
                      const SharedEncoder& encoder) {
  const simulation::SimulatedWorldOptions& world_options = recordings.office_world->options();
  place.view_sensor =
      simulation::make_view_sensor(place.renderer, recordings.true_camera, world_options.frame,
                                   world_options.sensor, encoder, nullptr);
}

/// A mission, and the office with a screen across the middle of the planned path.
struct ScreenedMission {
  simulation::Mission mission;
  simulation::MissionPlace place;
};

/// Returns the first of `missions` whose shortest path a screen makes longer but does not block;
/// nullopt if there is none.
std::optional<ScreenedMission> find_screened_mission(
    const simulation::MissionPlace& place, const simulation::RememberedPlace& remembered,
    const std::vector<simulation::Mission>& missions, const DemoRecordings& recordings,
    const SharedEncoder& encoder, Executor& executor) {
  constexpr double width_m = 0.6;
  constexpr double height_m = 1.0;
  constexpr double min_detour_m = 0.1;
  AreaPlanner planner(remembered.graph);
  for (const simulation::Mission& mission : missions) {
    const auto nearest = std::ranges::min_element(remembered.truth, {}, [&](const Pose2& pose) {
      return distance(pose.position(), mission.start.position());
    });
    planner.set_goal(mission.goal);
    const auto path =
        planner.plan_path(static_cast<std::size_t>(nearest - remembered.truth.begin()));
    if (path.size() < 4) continue;
    const Point2 before = remembered.truth[path[path.size() / 2 - 1]].position();
    const Point2 after = remembered.truth[path[path.size() / 2]].position();
    const Pose2 screen_pose{0.5 * (before.x_m + after.x_m), 0.5 * (before.y_m + after.y_m),
                            std::atan2(after.y_m - before.y_m, after.x_m - before.x_m)};
    simulation::MissionPlace screened = place;
    simulation::add_screen(screened.scene, screen_pose, width_m, height_m);
    screened.free_space = std::make_shared<const simulation::FreeSpace>(
        screened.scene, recordings.office_world->options().free_space);
    const Point2 goal = remembered.truth[*remembered.graph.node_of(mission.goal)].position();
    const auto direct = place.free_space->shortest_path(mission.start.position(), goal);
    const auto around = screened.free_space->shortest_path(mission.start.position(), goal);
    if (!direct || !around || path_length_m(*around) < path_length_m(*direct) + min_detour_m)
      continue;
    screened.renderer = std::make_shared<const simulation::Renderer>(
        screened.scene, simulation::RendererOptions{}, executor);
    set_robot_camera(screened, recordings, encoder);
    return ScreenedMission{mission, std::move(screened)};
  }
  return std::nullopt;
}

/// Draws all runs at once, one frame per image.
viewer::MapAnimation draw_runs(const DemoNavigation& navigation,
                               const simulation::RememberedPlace& remembered,
                               const std::vector<simulation::Mission>& missions,
                               const simulation::Scene& office) {
  viewer::MapLayer views{.label = "stored views", .colour = viewer::PlotColour::light_grey};
  for (const Pose2& pose : remembered.truth) views.circles.push_back(pose.position());
  viewer::MapLayer starts{.label = "start", .colour = viewer::PlotColour::green};
  viewer::MapLayer goals{.label = "goal", .colour = viewer::PlotColour::black};
  std::size_t longest = 0;
  for (std::size_t i = 0; i < navigation.runs.size(); ++i) {
    starts.squares.push_back(navigation.runs[i].path.front().position());
    goals.crosses.push_back(
        remembered.truth[*remembered.graph.node_of(missions[i].goal)].position());
    longest = std::max(longest, navigation.runs[i].path.size());
  }
  viewer::MapAnimation map{.title = "All missions", .backdrop = viewer::scene_layers(office)};
  for (const viewer::MapLayer& layer : {views, starts, goals}) map.backdrop.push_back(layer);
  for (std::size_t step = 0; step < longest; ++step) {
    viewer::MapLayer good{.label = "path to the goal", .colour = viewer::PlotColour::blue};
    viewer::MapLayer bad{.label = "ended elsewhere", .colour = viewer::PlotColour::vermilion};
    for (const simulation::MissionRun& run : navigation.runs) {
      std::vector<Point2> line = positions_of(run.path);
      const bool has_ended = line.size() <= step + 1;
      line.resize(std::min(line.size(), step + 1));
      viewer::MapLayer& layer = has_ended && !run.has_arrived(navigation.within_m) ? bad : good;
      layer.dots.push_back(line.back());
      if (line.size() > 1) layer.lines.push_back(std::move(line));
    }
    map.frames.push_back({.title = "image " + std::to_string(step + 1), .layers = {good, bad}});
  }
  return map;
}

/// Draws one run, decision by decision, over the planned path.
viewer::MapAnimation draw_run(const std::string& title, const simulation::MissionPlace& place,
                              const simulation::RememberedPlace& remembered,
                              const PlannerOptions& options, ViewId goal,
                              const simulation::MissionRun& run) {
  viewer::MapPlot backdrop =
      viewer::make_mission_plot(title, place, remembered, options, goal, run);
  std::erase_if(backdrop.layers,
                [](const viewer::MapLayer& layer) { return layer.label == "driven path"; });
  viewer::MapAnimation map{.title = title, .backdrop = std::move(backdrop.layers)};
  for (std::size_t step = 0; step < run.path.size(); ++step) {
    viewer::MapLayer driven{
        .label = "driven path", .colour = viewer::PlotColour::vermilion, .lines = {{}}};
    for (std::size_t i = 0; i <= step; ++i) {
      driven.lines.back().push_back(run.path[i].position());
      if (run.kidnapped_at == i) driven.lines.emplace_back();
    }
    std::erase_if(driven.lines, [](const auto& line) { return line.size() < 2; });
    driven.dots = {run.path[step].position()};
    map.frames.push_back({.title = step < run.decisions.size()
                                       ? "image " + std::to_string(step + 1) + ": " +
                                             std::string(to_string(run.decisions[step].state))
                                       : "the end",
                          .layers = {driven}});
  }
  return map;
}

/// Adds walls, views, the direction field and the goal to the first moment of a mission.
void add_plan_of_place(recordings::RunMoment& moment, const simulation::MissionPlace& place,
                       const simulation::RememberedPlace& remembered, const FieldOptions& field,
                       ViewId goal) {
  moment.walls = viewer::scene_outlines(place.scene);
  const auto guides = direction_field(remembered.graph, goal, field);
  for (std::size_t node = 0; node < guides.size(); ++node) {
    const Pose2& at = remembered.truth[node];
    moment.references.push_back(at.position());
    if (!guides[node].direction_rad) continue;
    moment.directions.push_back(
        {at.x_m, at.y_m, wrap_angle(at.heading_rad + *guides[node].direction_rad)});
  }
  moment.goal = remembered.truth[*remembered.graph.node_of(goal)];
}

/// Plays a mission with the robot's view and decision at each step.
viewer::RunPage replay_run(const simulation::MissionPlace& place,
                           const simulation::RememberedPlace& remembered,
                           const DemoRecordings& recordings, const MemoryFile& file,
                           const SharedEncoder& encoder, const PlannerOptions& options, ViewId goal,
                           const simulation::MissionRun& run) {
  const simulation::SimulatedWorldOptions& world_options = recordings.office_world->options();
  std::optional<Panorama> last_panorama;
  const auto capture_view = simulation::make_view_sensor(
      place.renderer, recordings.true_camera, world_options.frame, world_options.sensor, encoder,
      nullptr,
      [&](const Image& /*picture*/, const Panorama& panorama) { last_panorama = panorama; });
  AreaPlanner planner(remembered.graph, options);
  planner.set_goal(goal);
  viewer::RunPage page("A mission", run.decisions.size());
  bool planned = false;
  for (std::size_t i = 0; i < run.decisions.size(); ++i) {
    const NavigationDecision& decision = run.decisions[i];
    const Pose2& pose = run.path[i];
    recordings::RunMoment moment{.stamp_s = 0.5 * static_cast<double>(i), .pose = pose};
    moment.truth = ReferencePose{pose.x_m, pose.y_m, pose.heading_rad};
    moment.sure = decision.probability >= 0.5;
    moment.state = to_string(decision.state);
    moment.probability = decision.probability;
    for (const NavigationDecision::Event event : decision.events) {
      std::string name(to_string(event));
      std::ranges::replace(name, '_', ' ');
      moment.values.emplace_back("event", std::move(name));
    }
    const FourierSignature signature = capture_view(pose, i);
    moment.panorama = std::exchange(last_panorama, std::nullopt);
    if (decision.nearest) {
      moment.values.emplace_back("best_match", remembered.memory.info(*decision.nearest).name);
      moment.best_match = file.thumbnail(*decision.nearest).value_or(std::vector<std::uint8_t>{});
      moment.best_match_turn_rad =
          -home_vector(homing_view(remembered.memory.signature(*decision.nearest)),
                       homing_view(signature))
               .heading_rad;
      if (!planned) {  // the page shows only the plan of the start
        for (const std::size_t node :
             planner.plan_path(*remembered.graph.node_of(*decision.nearest))) {
          moment.plan.push_back(remembered.truth[node]);
        }
        planned = true;
      }
    }
    if (i == 0) add_plan_of_place(moment, place, remembered, options.field, goal);
    page.add(moment);
  }
  return page;
}

std::string describe_end(const simulation::MissionRun& run, double within_m) {
  const std::string name(to_string(run.end));
  if (run.end != NavigationDecision::State::arrived) return name;
  return run.has_arrived(within_m) ? "arrived" : "arrived, but too far from the goal";
}

/// Formats a heading with the outcome of a run, and a line for each step.
std::string format_log(const std::string& title, const std::string& goal,
                       const simulation::MissionRun& run, double within_m) {
  std::string text = title + ", to " + goal + ": " + describe_end(run, within_m) + ", " +
                     format_fixed(100.0 * run.end_distance_m, 0) + " cm from it\n";
  for (const NavigationDecision& decision : run.decisions) text += describe(decision) + "\n";
  return text + "\n";
}

/// Formats the log of all missions, of which `missions` are those of `navigation.runs` and the one
/// with the kidnapped robot.
std::string format_logs(const DemoNavigation& navigation, const VisualMemory& memory,
                        const std::vector<simulation::Mission>& missions,
                        const std::optional<ScreenedMission>& screened) {
  std::string log;
  const auto add_log = [&](const std::string& title, const simulation::Mission& mission,
                           const simulation::MissionRun& run) {
    log += format_log(title, memory.info(mission.goal).name, run, navigation.within_m);
  };
  for (std::size_t i = 0; i < navigation.runs.size(); ++i) {
    add_log("Mission " + std::to_string(i + 1), missions[i], navigation.runs[i]);
  }
  add_log("Mission with a kidnapped robot", missions.back(), navigation.kidnapped);
  if (screened) {
    add_log("Mission with a screen across the path", screened->mission, *navigation.screened);
  }
  return log;
}

/// Describes the result of a mission in a sentence.
std::string describe_run(const simulation::MissionRun& run, double within_m) {
  return "Result: " + describe_end(run, within_m) + ", " +
         format_fixed(100.0 * run.end_distance_m, 0) + " cm from the goal, after " +
         std::to_string(run.decisions.size()) + " steps and a drive of " +
         format_fixed(run.travelled_m, 1) + " m.";
}

/// The plots of the page.
struct MissionPlots {
  viewer::RunPage first;
  viewer::MapAnimation all;
  viewer::MapAnimation kidnapped;
  std::optional<viewer::MapAnimation> screened;
};

void add_part(const DemoNavigation& navigation, MissionPlots plots, viewer::ReportPage& page) {
  const std::string count = std::to_string(navigation.runs.size());
  const std::string arrived = std::to_string(navigation.arrived) + " of " + count;
  const std::string within = format_fixed(100.0 * navigation.within_m, 1) + " cm";
  page.begin_part("Navigation", {arrived, "robots reached their goals with images alone"});
  page.add_text(
      "The goal is a stored view. The robot does not know its start position, its heading, or the "
      "true positions of the views. It has no map of the walls and detects only obstacles directly "
      "in front of it. It uses the arrangement of the views that was computed in part 5. From this "
      "arrangement, it computes a direction towards the goal for each stored view. The robot takes "
      "an image, finds the most similar stored view, and drives one step in the direction that "
      "belongs to this view. It repeats this until it is near the goal. Then it drives to the goal "
      "with the method of part 6.");
  page.add_text(
      "In each mission, a robot drives to one goal. The robots started at " + count +
      " random places and were sent to " + count +
      " random stored views. In one additional mission, the robot was kidnapped (moved by hand) "
      "during its drive. In another additional mission, a new obstacle stood across the path: a "
      "screen. A mission is successful if the robot reports its arrival and its distance from the "
      "goal is at most half the spacing of the views, which is " +
      within + ".");
  page.add_figures(
      {{arrived, "missions were successful: the robot reported its arrival within " + within +
                     " of the goal"},
       {navigation.detours.empty() ? "none" : format_fixed(median(navigation.detours), 2),
        "median ratio of the length of the driven path to that of the shortest path"},
       {format_fixed(median(navigation.steps), 0), "median number of steps per mission"},
       {describe_end(navigation.kidnapped, navigation.within_m),
        "result of the mission with the kidnapped robot"},
       {navigation.screened ? describe_end(*navigation.screened, navigation.within_m) : "none",
        navigation.screened
            ? "result of the mission with a screen across the path"
            : "no mission with a screen, because the screen would block every path"}});
  page.add_text(
      "The animation below shows the first mission, image by image. Short lines: the direction "
      "towards the goal at each stored view. Thick line: the planned path. Below the robot's "
      "image, the page shows the most similar stored view, rotated to the robot's heading.");
  page.add_run(plots.first);
  std::vector<viewer::ReportPlot> maps{
      {std::move(plots.all),
       "All missions at once. If a robot does not reach its goal, its path turns orange."},
      {std::move(plots.kidnapped),
       "In the middle of its drive, this robot was carried by hand to the purple square. " +
           describe_run(navigation.kidnapped, navigation.within_m)}};
  if (plots.screened) {
    maps.push_back({std::move(*plots.screened),
                    "A screen (short dark line) stands across the middle of the planned path. The "
                    "stored views do not show this screen, but there is a path around it. " +
                        describe_run(*navigation.screened, navigation.within_m)});
  }
  page.add_plots(maps);
  page.add_link("mission.log", "Log of all decisions of the robots");
}

/// Fills the measures of `navigation.runs`.
void count_arrivals(DemoNavigation& navigation) {
  for (const simulation::MissionRun& run : navigation.runs) {
    navigation.steps.push_back(static_cast<double>(run.decisions.size()));
    if (!run.has_arrived(navigation.within_m)) continue;
    ++navigation.arrived;
    if (run.shortest_m > 0.0) navigation.detours.push_back(run.travelled_m / run.shortest_m);
  }
}

/// Returns the value of --start of panonav navigate.
std::string format_start(const Pose2& start) {
  return format_fixed(start.x_m, 3) + "," + format_fixed(start.y_m, 3) + "," +
         format_fixed(degrees(start.heading_rad), 1);
}

}  // namespace

DemoNavigation demonstrate_navigation(const DemoOptions& options, const DemoRecordings& recordings,
                                      const MemoryFile& file, const VisualMemory& memory,
                                      const Lattice& arranged,
                                      std::shared_ptr<const ViewEncoder> encoder, Session& session,
                                      viewer::ReportPage& page) {
  Executor& executor = session.executor();
  const simulation::RememberedPlace remembered =
      make_remembered_office(memory, arranged, options.spacing_m());
  simulation::MissionPlace place = simulation::make_mission_place(*recordings.office_world);
  set_robot_camera(place, recordings, encoder);
  const auto sample_random_missions = [&](std::uint64_t stream, int count, bool kidnapped) {
    return simulation::sample_missions(place, remembered, {.count = count, .kidnapped = kidnapped},
                                       Random(options.seed, stream).next());
  };
  auto missions = sample_random_missions(mission_stream, options.mission_count(), false);
  missions.push_back(sample_random_missions(kidnapped_stream, 1, true).front());
  const simulation::MissionOptions settings;
  const std::uint64_t noise = Random(options.seed, noise_stream).next();
  DemoNavigation navigation{.within_m = 0.5 * options.spacing_m()};
  navigation.runs =
      simulation::run_missions(place, remembered, missions, settings, noise, executor);
  navigation.kidnapped = std::move(navigation.runs.back());
  navigation.runs.pop_back();
  count_arrivals(navigation);
  const auto draw_mission = [&](const std::string& title, const simulation::MissionPlace& where,
                                const simulation::Mission& mission,
                                const simulation::MissionRun& run) {
    return draw_run(title, where, remembered, settings.planner, mission.goal, run);
  };
  const simulation::Mission& first = missions.front();
  MissionPlots plots{.first = replay_run(place, remembered, recordings, file, encoder,
                                         settings.planner, first.goal, navigation.runs.front()),
                     .all = draw_runs(navigation, remembered, missions, recordings.office_scene),
                     .kidnapped = draw_mission("Mission with a kidnapped robot", place,
                                               missions.back(), navigation.kidnapped)};
  navigation.all = plots.all;
  navigation.first_mission = {"--goal", memory.info(first.goal).name, "--start",
                              format_start(first.start)};
  constexpr int candidates = 30;
  const auto screened = find_screened_mission(
      place, remembered, sample_random_missions(screen_stream, candidates, false), recordings,
      encoder, executor);
  if (screened) {
    navigation.screened = simulation::run_missions(screened->place, remembered, {screened->mission},
                                                   settings, noise, executor)
                              .front();
    plots.screened = draw_mission("Mission with a screen across the path", screened->place,
                                  screened->mission, *navigation.screened);
  }
  write_file(options.out / "mission.log",
             std::string_view(format_logs(navigation, memory, missions, screened)));
  add_part(navigation, std::move(plots), page);
  return navigation;
}

}  // namespace panonav::command
