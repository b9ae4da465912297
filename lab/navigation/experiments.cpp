#include "lab/experiments.hpp"
#include "panonav_simulation/make_each.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "lab/rows.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/route/route_position.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/mission.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/screen.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/mission_picture.hpp"

namespace panonav::lab {

namespace {

// Relative change of light: darker in every second variant, brighter in the others.
constexpr double light_change = 0.3;
constexpr double moved_objects_fraction = 0.1;
// Spacing of the references along a drive, and length of a drive.
constexpr double drive_spacing_m = 0.25;
constexpr double drive_length_m = 60.0;
// Largest distance of a mission's start from the drive, as if a person set the robot down.
constexpr double max_start_offset_m = 0.3;

// Results of all missions of one kind.
struct MissionResults {
  std::size_t runs = 0;
  std::size_t arrived = 0;
  std::size_t falsely_arrived = 0;  // reported an arrival elsewhere
  std::map<NavigationDecision::State, std::size_t> ends;
  std::vector<double> relative_lengths;  // path length over the shortest, of missions that arrived
  std::vector<double> steps;
  double bytes_read = 0.0;  // sum over all steps
  double travelled_m = 0.0;
  double contacts = 0.0;  // commands that an obstacle ended

  void add(const std::vector<simulation::MissionRun>& missions, double radius_m) {
    for (const simulation::MissionRun& run : missions) {
      ++runs;
      const bool has_arrived = run.has_arrived(radius_m);
      arrived += static_cast<std::size_t>(has_arrived);
      falsely_arrived +=
          static_cast<std::size_t>(!has_arrived && run.end == NavigationDecision::State::arrived);
      ++ends[run.end];
      travelled_m += run.travelled_m;
      contacts += static_cast<double>(run.contacts);
      steps.push_back(static_cast<double>(run.decisions.size()));
      for (const NavigationDecision& step : run.decisions) {
        bytes_read += static_cast<double>(step.bytes_read);
      }
      if (has_arrived && run.shortest_m > 0.0)
        relative_lengths.push_back(run.travelled_m / run.shortest_m);
    }
  }

  [[nodiscard]] double bytes_per_step() const {
    return bytes_read / std::accumulate(steps.begin(), steps.end(), 0.0);
  }
};

void report(const std::string& id, const std::string& what, const MissionResults& measured,
            std::optional<Target> arrival, std::optional<Target> length, Reproduction& result) {
  add_rate(result, id + ".arrived", what + ": arrive within half the reference spacing",
           measured.arrived, measured.runs, arrival);
  result.rows.back().reason =
      simulation::explain_other_ends(measured.ends, measured.falsely_arrived);
  if (!measured.relative_lengths.empty()) {
    add_median(result, id + ".length", what + ": path length against the shortest", "",
               measured.relative_lengths, length);
  }
  add_rate(result, id + ".wrongly", what + ": report an arrival but are farther off",
           measured.falsely_arrived, measured.runs);
  for (const auto& [end, count] : measured.ends) {
    if (end == NavigationDecision::State::arrived) continue;
    add_rate(result, id + "." + std::string(to_string(end)),
             what + ": end as " + std::string(to_string(end)), count, measured.runs);
  }
  add_median(result, id + ".steps", what + ": steps", "", measured.steps);
}

// Missions of a robot with one sensor for obstacles.
struct SensorMissions {
  simulation::ObstacleSensor sensor;
  std::string id;
  std::string what;
  double min_fraction;  // share of the arrivals with the true free space
  MissionResults measures;
};

std::vector<SensorMissions> make_sensor_missions() {
  using enum simulation::ObstacleSensor;
  return {{truth, "truth", "the true free space, which no robot knows", 1.0, {}},
          {bumper, "bumper", "a bumper alone", 0.9, {}},
          {ranges, "ranges", "a bumper and eight noisy ranges", 0.95, {}},
          {camera, "camera", "a bumper and the floor in the pictures", 0.95, {}}};
}

void report_sensors(const std::string& id, const std::string& what,
                    const std::vector<SensorMissions>& sensors, Reproduction& result) {
  const auto arrived = [](const SensorMissions& kind) {
    return static_cast<double>(kind.measures.arrived);
  };
  for (const SensorMissions& kind : sensors) {
    const std::string named = what + ", the same missions with " + kind.what;
    add_rate(result, id + "." + kind.id + ".arrived", named + ": arrive", kind.measures.arrived,
             kind.measures.runs);
    if (kind.measures.travelled_m > 0.0) {
      add_row(result, id + "." + kind.id + ".contacts", named + ": contacts in 100 m",
              100.0 * kind.measures.contacts / kind.measures.travelled_m, "");
    }
    if (&kind == &sensors.front() || arrived(sensors.front()) == 0.0) continue;
    add_row(result, id + "." + kind.id + ".of_truth",
            named + ": arrivals against those with the true free space",
            arrived(kind) / arrived(sensors.front()), "", at_least(kind.min_fraction));
  }
}

int count_runs(const ReproductionOptions& options, int scene) {
  return options.runs / options.scenes + (scene < options.runs % options.scenes ? 1 : 0);
}

void draw_mission(const std::string& name, const simulation::MissionPlace& place,
                  const simulation::RememberedPlace& remembered, const simulation::Mission& mission,
                  const simulation::MissionRun& run, Reproduction& result) {
  const std::string file = "mission_" + name + ".svg";
  viewer::write_mission_picture(result.out / file, name, place, remembered, {}, mission.goal, run);
  result.pictures.push_back(
      {file, "A mission in " + name +
                 ": every reference view says in which direction the goal lies; the robot takes "
                 "the direction of the one it is nearest to and looks again."});
}

// Plans a drive of `drive_length_m`: repeated round trips of the scene, or without these paths
// between random positions, with 10 cm clearance on both sides of the robot.
std::vector<Pose2> plan_exploring_drive(const simulation::MissionPlace& place, std::uint64_t seed) {
  Random random(seed, 5);
  simulation::FreeSpaceOptions wide_clearance = simulation::free_space_options(place.scene);
  wide_clearance.robot_radius_m += 0.1;
  const simulation::FreeSpace space(place.scene, wide_clearance);
  std::vector<Point2> corners;
  while (path_length_m(corners) < drive_length_m) {
    if (place.scene.tour.empty()) {
      corners.push_back(space.random_pose(random).position());
    } else {
      corners.insert(corners.end(), place.scene.tour.begin(), place.scene.tour.end());
    }
  }
  std::vector<Pose2> poses;
  for (const simulation::RecordedPose& pose :
       simulation::plan_recording(place.scene, space,
                                  {.path = simulation::RecordingPath::tour,
                                  .heading = simulation::RecordingHeading::path,
                                  .spacing_m = drive_spacing_m},
                                  {}, seed, corners)) {
    poses.push_back(pose.pose);
  }
  poses.resize(
      std::min(poses.size(), static_cast<std::size_t>(drive_length_m / drive_spacing_m) + 1));
  return poses;
}

// Returns the scene with screens as high as a robot across the path at the poses `across`.
simulation::Scene add_screens(simulation::Scene scene, std::span<const Pose2> across,
                              double width_m) {
  for (const Pose2& at : across) simulation::add_screen(scene, at, width_m, 1.0);
  return scene;
}

// Returns the smallest width at which screens leave no path between `from` and `to`; nullopt if no
// tried width blocks the path while both ends stay free.
std::optional<double> find_blocking_width_m(const simulation::Scene& scene,
                                            std::span<const Pose2> across, Point2 from, Point2 to) {
  for (const double width_m : {2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0}) {
    const simulation::Scene shut = add_screens(scene, across, width_m);
    const simulation::FreeSpaceOptions room = simulation::free_space_options(shut);
    const simulation::FreeSpace largest(shut, room);
    const double min_m = room.robot_radius_m + 2.0 * room.cell_m;
    if (largest.clearance_m(from) < min_m || largest.clearance_m(to) < min_m) break;
    if (!simulation::FreeSpace(shut, room, from).is_free(to)) return width_m;
  }
  return std::nullopt;
}

}  // namespace

simulation::MissionPlace NavigationExperiments::make_place(simulation::Scene scene,
                                                           std::optional<Point2> inside) const {
  simulation::MissionPlace place =
      simulation::make_mission_place(std::move(scene), executor, inside);
  constexpr int pixel_size = 2;
  place.rendering = make_rendering(place.rendering.rows, place.rendering.columns, pixel_size);
  return place;
}

void NavigationExperiments::reproduce_grid_missions(const std::string& scene,
                                                    double spacing_m) const {
  MissionResults measured;
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    const simulation::MissionPlace place =
        make_place(simulation::make_scene(scene, {.seed = seed}));
    const simulation::RememberedPlace remembered =
        simulation::memorise_grid(place, spacing_m, Random(seed, 1).next(), executor);
    const auto missions = simulation::sample_missions(
        place, remembered, {.count = count_runs(options, i)}, Random(seed, 2).next());
    simulation::MissionOptions mission;
    mission.base.drive = i % 2 == 0 ? DriveKind::differential : DriveKind::holonomic;
    const auto runs = simulation::run_missions(place, remembered, missions, mission,
                                               Random(seed, 3).next(), executor);
    measured.add(runs, 0.5 * spacing_m);
    if (i == 0) draw_mission(scene, place, remembered, missions.front(), runs.front(), result);
  }
  report("m04.fig18." + scene,
         "figure 18: " + scene + ", references every " + format_centimetres(spacing_m) +
             " arranged by similarity alone",
         measured, at_least(0.98), at_most(1.3), result);
}

void NavigationExperiments::reproduce_drive_missions(const std::string& scene) const {
  MissionResults changed;
  MissionResults kidnapped;
  MissionResults monte_carlo_kidnapped;
  std::vector<SensorMissions> sensors = make_sensor_missions();
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    simulation::SceneVariation variation{.seed = seed};
    simulation::MissionPlace place =
        make_place(simulation::make_or_read_scene(options.data, scene, variation));
    simulation::add_floor_camera(place);
    const simulation::RememberedPlace remembered = simulation::memorise_drive(
        place, plan_exploring_drive(place, seed), simulation::make_noisy_wheels(),
        Random(seed, 1).next(), executor);
    variation.light = i % 2 == 0 ? 1.0 - light_change : 1.0 + light_change;
    variation.moved_objects = moved_objects_fraction;
    variation.moved_seed = Random(seed, 4).next();
    const simulation::MissionPlace other =
        make_place(simulation::make_or_read_scene(options.data, scene, variation));
    simulation::MissionOptions mission;
    mission.base.drive = i % 2 == 0 ? DriveKind::differential : DriveKind::holonomic;
    const double radius_m = 0.5 * remembered.spacing_m;
    const auto run = [&](const simulation::MissionPlace& where, bool is_kidnapped,
                         std::uint64_t stream, MissionResults& measures) {
      const auto missions = simulation::sample_missions(where, remembered,
                                                        {.count = count_runs(options, i),
                                                         .max_distance_m = max_start_offset_m,
                                                         .kidnapped = is_kidnapped},
                                                        Random(seed, stream).next());
      const auto runs = simulation::run_missions(where, remembered, missions, mission,
                                                 Random(seed, stream + 1).next(), executor);
      measures.add(runs, radius_m);
      if (i == 0 && &measures == &sensors[1].measures) {
        draw_mission(scene, where, remembered, missions.front(), runs.front(), result);
      }
    };
    for (SensorMissions& kind : sensors) {
      mission.obstacles = kind.sensor;
      run(place, false, 5, kind.measures);
    }
    mission.obstacles = simulation::MissionOptions{}.obstacles;
    run(other, false, 7, changed);
    run(place, true, 9, kidnapped);
    if (scene == "corridor") {
      // Repeat the kidnapped missions with the same seeds, so that both can be compared.
      mission.monte_carlo = true;
      run(place, true, 9, monte_carlo_kidnapped);
    }
  }
  const std::string what = scene + ", map of a drive of 60 m";
  report("navigation." + scene, what, sensors[1].measures, at_least(0.95), std::nullopt, result);
  report_sensors("navigation." + scene, what, sensors, result);
  const bool has_movable_objects =
      std::ranges::find(simulation::scene_names(), scene) != simulation::scene_names().end();
  report("navigation." + scene + ".changed",
         what + (has_movable_objects ? ", light changed by 30 % and 10 % of the objects moved"
                                     : ", light changed by 30 %"),
         changed, at_least(0.9), std::nullopt, result);
  report("navigation." + scene + ".kidnapped", what + ", kidnapped half way", kidnapped,
         at_least(0.9), std::nullopt, result);
  if (monte_carlo_kidnapped.runs > 0) {
    report("navigation." + scene + ".monte_carlo",
           what + ", the same missions with Monte-Carlo localisation where the place is in doubt",
           monte_carlo_kidnapped, std::nullopt, std::nullopt, result);
  }
}

void NavigationExperiments::reproduce_tours() const {
  constexpr int goals_per_tour = 5;
  constexpr int people = 3;
  struct MissionKind {
    std::string id;
    std::string what;
    simulation::MissionOptions options;
    MissionResults measures;
  };
  std::vector<MissionKind> kinds{
      {"tour", "one goal after the other", {}, {}},
      {"people", "the same with three people who walk about", {}, {}},
      {"accurate", "the same with all components compared at each step", {}, {}}};
  kinds[1].options.people = people;
  kinds[2].options.navigator.coarse_components = 0;
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    const simulation::MissionPlace place =
        make_place(simulation::make_scene("loop", {.seed = seed}));
    const simulation::RememberedPlace remembered = simulation::memorise_drive(
        place, plan_exploring_drive(place, seed), simulation::make_noisy_wheels(),
        Random(seed, 1).next(), executor);
    const AreaPlanner planner(remembered.graph);
    const MemoryViewSource source(remembered.memory);
    const int tours = (count_runs(options, i) + goals_per_tour - 1) / goals_per_tour;
    const auto missions = simulation::sample_missions(
        place, remembered, {.count = tours * goals_per_tour, .max_distance_m = max_start_offset_m},
        Random(seed, 12).next());
    for (MissionKind& kind : kinds) {
      auto runs =
          simulation::make_each(executor, static_cast<std::size_t>(tours), [&](std::size_t t) {
            std::vector<ViewId> goals;
            for (std::size_t k = 0; k < goals_per_tour; ++k) {
              goals.push_back(missions[t * goals_per_tour + k].goal);
            }
            Navigator navigator(source, planner, kind.options.navigator);
            return simulation::run_tour(place, remembered, navigator,
                                        missions[t * goals_per_tour].start, goals, kind.options,
                                        Random(seed, 200 + t).next());
          });
      for (const auto& tour : runs) kind.measures.add(tour, 0.5 * remembered.spacing_m);
    }
  }
  for (const MissionKind& kind : kinds) {
    report("navigation." + kind.id, "loop, tours of five goals, " + kind.what, kind.measures,
           std::nullopt, std::nullopt, result);
    add_row(result, "navigation." + kind.id + ".read",
            "loop, tours of five goals, " + kind.what +
                ": read of signatures and index by a step, mean",
            1e-3 * kind.measures.bytes_per_step(), "kB");
  }
}

void NavigationExperiments::reproduce_route_missions() const {
  struct MissionKind {
    std::string id;
    std::string what;
    MissionResults measures;
    std::vector<double> lateral_distance_m;  // from the path of the recorded drive
  };
  std::vector<MissionKind> kinds{{"route", "with the route recorded on it", {}, {}},
                                 {"without_route", "the same missions without the route", {}, {}}};
  std::vector<double> on_route_m;
  std::map<NavigationDecision::Event, std::size_t> events;
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    simulation::MissionPlace place = make_place(simulation::make_scene("loop", {.seed = seed}));
    place.line = simulation::make_line_sensor(place);
    const auto drive = plan_exploring_drive(place, seed);
    simulation::RememberedPlace remembered = simulation::memorise_drive(
        place, drive, simulation::make_noisy_wheels(), Random(seed, 1).next(), executor);
    const auto missions = simulation::sample_missions(
        place, remembered, {.count = count_runs(options, i), .max_distance_m = max_start_offset_m},
        Random(seed, 13).next());
    for (MissionKind& kind : kinds) {
      const auto runs = simulation::run_missions(place, remembered, missions, {},
                                                 Random(seed, 14).next(), executor);
      kind.measures.add(runs, 0.5 * remembered.spacing_m);
      for (const simulation::MissionRun& run : runs) {
        for (std::size_t step = 0; step < run.decisions.size(); ++step) {
          const double lateral_distance_m =
              std::abs(project_onto_route(drive, run.path[step].position()).lateral_m);
          kind.lateral_distance_m.push_back(lateral_distance_m);
          if (run.decisions[step].on_route) on_route_m.push_back(lateral_distance_m);
          for (const NavigationDecision::Event event : run.decisions[step].events) ++events[event];
        }
      }
      remembered.routes.clear();
    }
  }
  const std::string map = "loop, map of a drive of 60 m, ";
  for (const MissionKind& kind : kinds) {
    report("navigation." + kind.id, map + kind.what, kind.measures, std::nullopt, std::nullopt,
           result);
    add_median(result, "navigation." + kind.id + ".off",
               map + kind.what + ": distance from the recorded path", "m", kind.lateral_distance_m);
  }
  const std::string what = map + kinds.front().what;
  add_rate(result, "navigation.route.share", what + ": steps on a leg along the route",
           on_route_m.size(), kinds.front().lateral_distance_m.size());
  if (on_route_m.empty()) return;
  add_rate(result, "navigation.route.left", what + ": legs that did not come to their end",
           events[NavigationDecision::Event::route_left], events[NavigationDecision::Event::route]);
  add_median(result, "navigation.route.leg_off",
             what + ": distance from the recorded path, on a leg", "m", on_route_m);
}

void NavigationExperiments::reproduce_blocked_missions() const {
  MissionResults around;
  MissionResults shut;
  for (int i = 0; i < options.scenes; ++i) {
    const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(i);
    const simulation::Scene scene = simulation::make_scene("loop", {.seed = seed});
    const simulation::MissionPlace place = make_place(scene);
    const auto drive = plan_exploring_drive(place, seed);
    const simulation::RememberedPlace remembered = simulation::memorise_drive(
        place, drive, simulation::make_noisy_wheels(), Random(seed, 1).next(), executor);
    double tour_m = 0.0;
    for (std::size_t k = 0; k < scene.tour.size(); ++k) {
      tour_m += distance(scene.tour[k], scene.tour[(k + 1) % scene.tour.size()]);
    }
    const auto round = static_cast<std::size_t>(tour_m / drive_spacing_m);
    Random random(seed, 11);
    for (int k = 0; k < count_runs(options, i);) {
      // Start and goal are a quarter of the round trip apart. One screen is halfway between them,
      // the other one on the opposite side of the loop.
      const std::size_t start = random.index(round);
      const std::size_t goal = (start + round / 4) % round;
      const std::array<Pose2, 2> screens{drive[(start + round / 8) % round],
                                         drive[(start + round / 8 + round / 2) % round]};
      const simulation::Mission mission{remembered.graph.view(goal), drive[start], {}};
      const auto width_m =
          find_blocking_width_m(scene, screens, mission.start.position(), drive[goal].position());
      if (!width_m) continue;
      for (const bool both : {false, true}) {
        const simulation::MissionPlace now =
            make_place(add_screens(scene, std::span(screens).first(both ? 2 : 1), *width_m),
                       mission.start.position());
        const auto runs = simulation::run_missions(
            now, remembered, {mission}, {},
            Random(seed, 100 + static_cast<std::uint64_t>(k)).next(), executor);
        (both ? shut : around).add(runs, 0.5 * remembered.spacing_m);
        if (i == 0 && k == 0 && !both) {
          draw_mission("loop_blocked", now, remembered, mission, runs.front(), result);
        }
      }
      ++k;
    }
  }
  const std::string what = "loop, a screen across the path";
  report("navigation.blocked", what + ", with a detour", around, at_least(0.9), std::nullopt,
         result);
  add_rate(result, "navigation.shut.unreachable", what + " on both sides: reported unreachable",
           shut.ends[NavigationDecision::State::unreachable], shut.runs, at_least(0.9));
  result.rows.back().reason = simulation::explain_other_ends(
      shut.ends, shut.falsely_arrived, NavigationDecision::State::unreachable);
  add_rate(result, "navigation.shut.arrived", what + " on both sides: report an arrival",
           shut.ends[NavigationDecision::State::arrived], shut.runs);
  add_median(result, "navigation.shut.steps", what + " on both sides: steps until reported", "",
             shut.steps);
  add_row(result, "navigation.shut.max_steps", what + " on both sides: steps, most",
          *std::ranges::max_element(shut.steps), "");
}

}  // namespace panonav::lab
