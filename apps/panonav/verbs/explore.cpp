#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/json.hpp"
#include "cli/option_values.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/robot_explorer.hpp"
#include "panonav_simulation/exploration.hpp"
#include "panonav_simulation/memory_mission.hpp"
#include "runs/simulated_recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;
using State = ExplorationDecision::State;

// Distance of the positions at which the coverage is measured.
constexpr double coverage_grid_m = 0.25;

struct ExploreArguments {
  std::string scene;
  std::string out;
  std::optional<std::string> start;
  std::optional<std::string> obstacles;
  simulation::SimulatedWorldOptions simulation;
  ExplorationOptions exploration;
  BaseOptions base;
};

/// Compares the exploration with a sweep, by true poses.
struct Judgement {
  double covered = 0.0;        ///< share of the floor
  double sweep_covered = 0.0;  ///< the same for the sweep
  simulation::Sweep sweep;
};

/// Stores the images that become views, and the map at the end.
class MemoryWriter {
 public:
  MemoryWriter(const std::string& path, const PictureSource& source) : memory_(path, source) {}

  void set_image(const Image& image) { image_ = image; }
  void add_view() { memory_.add(Observation(image_.value())); }
  void finish(const Explorer& explorer, Executor& executor) { memory_.finish(explorer, executor); }

 private:
  ExplorationMemory memory_;
  std::optional<Image> image_;
};

simulation::MissionPlace make_place(const simulation::SimulatedWorld& world, MemoryWriter& writer,
                                    std::uint64_t seed, const Pose2& start, Executor& executor) {
  simulation::MissionPlace place = simulation::make_mission_place(world);
  const std::vector<Observation> first{world.capture_image(start, seed, executor)};
  const MemoryHeader header = make_memory_header(first, world.source(), {}, {}, executor);
  place.view_sensor = simulation::make_view_sensor(
      place.renderer, world.camera(), world.options().frame, world.options().sensor,
      std::make_shared<const ViewEncoder>(header, world.source()), &executor,
      [&writer](const Image& image, const Panorama&) { writer.set_image(image); });
  return place;
}

Judgement judge(simulation::MissionPlace place, const simulation::SimulatedWorld& world,
                const simulation::ExplorationRun& run, double radius_m, std::uint64_t seed,
                Executor& executor) {
  const std::vector<Observation> first{world.capture_image(run.path.front(), seed, executor)};
  const MemoryHeader header = make_memory_header(first, world.source(), {}, {}, executor);
  place.view_sensor = simulation::make_view_sensor(
      place.renderer, world.camera(), world.options().frame, world.options().sensor,
      std::make_shared<const ViewEncoder>(header, world.source()), nullptr);
  Judgement result{.sweep = simulation::plan_sweep(*place.free_space, radius_m)};
  const auto measure = [&](const std::vector<Pose2>& views) {
    return simulation::measure_coverage(place, views, radius_m, coverage_grid_m, seed, executor);
  };
  result.covered = measure(run.views);
  result.sweep_covered = measure(result.sweep.views);
  return result;
}

void print_step(const ExplorationDecision& decision, const Pose2& truth, const Explorer& explorer,
                State& state, Session& session) {
  if (session.json()) {
    session.print(json_line(ordered_json{{"state", to_string(decision.state)},
                                         {"memorised", decision.memorise},
                                         {"direction_rad", decision.direction_rad},
                                         {"advance_m", decision.advance_m},
                                         {"estimate", pose_json(explorer.pose())},
                                         {"pose", pose_json(truth)}}));
  } else if (decision.state != state) {
    session.print(std::string(to_string(decision.state)) + " after " +
                  format_fixed(explorer.travelled_m(), 1) + " m with " +
                  format_count(explorer.view_poses().size(), "view"));
  }
  state = decision.state;
}

void print_summary(const ExploreArguments& arguments, const simulation::ExplorationRun& run,
                   const Judgement& judgement, Session& session) {
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.out},
                                         {"scene", arguments.scene},
                                         {"end", to_string(run.end)},
                                         {"views", run.views.size()},
                                         {"observations", run.path.size()},
                                         {"explored_m", run.explored_m},
                                         {"travelled_m", run.travelled_m},
                                         {"contacts", run.contacts},
                                         {"end_distance_m", run.end_distance_m},
                                         {"covered", judgement.covered},
                                         {"sweep_m", judgement.sweep.length_m},
                                         {"sweep_views", judgement.sweep.views.size()},
                                         {"sweep_covered", judgement.sweep_covered}}));
    return;
  }
  session.print(session.bold(format_count(run.views.size(), "view")) + " in " + arguments.out +
                " after " + format_fixed(run.explored_m, 1) + " m and " +
                format_count(run.contacts, "contact"));
  session.print("covered: " + format_fixed(100.0 * judgement.covered, 1) +
                " % of the free floor; a sweep with true poses drives " +
                format_fixed(judgement.sweep.length_m, 1) + " m and covers " +
                format_fixed(100.0 * judgement.sweep_covered, 1) + " %");
  session.print(std::string(run.end == State::done ? "returned to" : "ended") + " " +
                format_fixed(run.end_distance_m, 2) + " m from the start after " +
                format_fixed(run.travelled_m, 1) + " m");
}

ExitCode explore(const Arguments& declared, const ExploreArguments& arguments, Session& session) {
  if (declared.is_set("odometry", "drive")) {
    throw UsageError(
        "--odometry-drive: the drive of the robot is set with --drive; leave out --odometry-drive");
  }
  std::error_code ignored;
  if (fs::exists(arguments.out, ignored)) {
    throw FileError(arguments.out, "already exists; allowed: a new memory file");
  }
  Executor& executor = session.executor();
  const simulation::SimulatedWorld world(
      arguments.scene, arguments.simulation, make_option_lookup(declared), executor,
      [&](const std::string& warning) { session.note("warning: " + warning); });
  const auto seed = static_cast<std::uint64_t>(arguments.simulation.simulation.scene.seed);
  Random random(seed, 6);
  const Pose2 start = arguments.start
                          ? parse_free_pose("--start", *arguments.start, world.free_space())
                          : world.free_space().random_pose(random);
  MemoryWriter writer(arguments.out, world.source());
  const auto place = make_place(world, writer, seed, start, executor);
  const simulation::ExplorationRobot robot{.base = arguments.base,
                                           .motion = arguments.simulation.odometry,
                                           .obstacles = arguments.obstacles == "bumper"
                                                            ? simulation::ObstacleSensor::bumper
                                                            : simulation::ObstacleSensor::ranges};
  Explorer explorer(arguments.exploration, place.scene.robot_radius_m,
                    robot.obstacles == simulation::ObstacleSensor::ranges, robot.motion);
  State state = State::exploring;
  const auto run =
      simulation::run_exploration(place, explorer, robot, start, seed,
                                  [&](const ExplorationDecision& decision, const Pose2& truth) {
                                    if (decision.memorise) writer.add_view();
                                    print_step(decision, truth, explorer, state, session);
                                  });
  writer.finish(explorer, executor);
  const Judgement judgement =
      judge(place, world, run, arguments.exploration.radius_m, seed, executor);
  print_summary(arguments, run, judgement, session);
  return run.end == State::done ? ExitCode::done : ExitCode::no_answer;
}

Run declare_explore(Arguments& arguments) {
  auto values = std::make_shared<ExploreArguments>();
  const auto scenes = simulation::scene_names();
  arguments.positional(
      "SCENE", values->scene,
      "Built-in scene (" + join_texts(scenes) + "), Gazebo world (.world, .sdf) or mesh file",
      {scenes.begin(), scenes.end()});
  arguments.positional("MEMORY", values->out, "New memory file");
  arguments.option("--start X,Y,DEG", values->start,
                   "Start position in metres and heading in degrees; default: a random pose that "
                   "is free of obstacles");
  arguments.choice("--obstacles", values->obstacles, {"bumper", "ranges"},
                   "Sensor of the robot for obstacles: a bumper that feels contact and its side, "
                   "or eight noisy ranges in addition (default: ranges)");
  arguments.options("exploration", values->exploration);
  arguments.options("base", values->base);
  arguments.options("simulation", values->simulation.simulation);
  arguments.options("frame", values->simulation.frame);
  arguments.options("sensor", values->simulation.sensor);
  arguments.options("free_space", values->simulation.free_space);
  arguments.options("odometry", values->simulation.odometry, "odometry");
  reject_ineffective_camera_options(arguments, values->simulation);
  arguments.show_in_help({"--radius-m", "--max-metres", "--seed", "--kind"});
  arguments.declare_outputs({"MEMORY"});
  arguments.explain_interruption(
      "MEMORY contains the views so far, without a map. To start over, choose another file.");
  return [values, &arguments](Session& session) { return explore(arguments, *values, session); };
}

}  // namespace

Verb explore_verb() {
  return {
      "explore",
      VerbGroup::experiments,
      "Let a simulated robot explore a place and make its memory",
      "The robot knows images, odometry with noise, and what its sensor for obstacles feels. It "
      "drives to where a new view covers most floor, and back to its start when the catchment "
      "areas of the views cover the floor that it found. The memory contains the views and "
      "their map. True poses only measure the share of the floor that is covered. The exit "
      "code is 1 if the robot gets lost.",
      "  panonav explore office office.panonav --kind panorama\n"
      "  panonav explore lab lab.panonav --kind panorama --obstacles bumper --max-metres 10",
      declare_explore};
}

}  // namespace panonav::command
