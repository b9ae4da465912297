#include <cmath>
#include <filesystem>

#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "runs/ros2_robot.hpp"
#include "runs/run_record.hpp"
#include "runs/simulated_recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct SimulateArguments {
  std::string scene;
  std::vector<std::string> out;
  bool ros2 = false;
  std::optional<double> grid_m;
  std::optional<std::uint64_t> random;
  std::optional<std::string> trajectory;
  RunRecordArguments record;
  simulation::SimulatedWorldOptions simulation;
  Ros2Robot robot;
};

/// --grid, --random and --trajectory each say all of the way; with the options of [recording] they
/// would contradict.
void apply_shorthands(const Arguments& arguments, SimulateArguments& wanted) {
  const int ways = (wanted.grid_m ? 1 : 0) + (wanted.random ? 1 : 0) + (wanted.trajectory ? 1 : 0);
  if (ways > 1 || (ways == 1 && arguments.given("recording", "path"))) {
    throw UsageError("--grid, --random, --trajectory and --path exclude each other; take one");
  }
  auto& recording = wanted.simulation.recording;
  if (wanted.grid_m) {
    if (!(*wanted.grid_m > 0.0)) {
      throw UsageError("--grid is " + to_text(*wanted.grid_m) + "; allowed: > 0 metres");
    }
    recording.path = simulation::RecordingPath::grid;
    recording.spacing_m = *wanted.grid_m;
  }
  if (wanted.random) {
    constexpr std::uint64_t most = 1000000;
    if (*wanted.random == 0 || *wanted.random > most) {
      throw UsageError("--random is " + std::to_string(*wanted.random) + "; allowed: 1 to " +
                       std::to_string(most));
    }
    recording.path = simulation::RecordingPath::random;
    recording.poses = static_cast<int>(*wanted.random);
  }
  if (arguments.given("recording", "heading")) return;
  recording.heading = simulation::default_heading(recording.path);
}

std::vector<simulation::RecordedPose> poses_of_file(const std::string& path,
                                                    const simulation::SimulatedWorld& world) {
  const auto trajectory = read_trajectory(path);
  if (trajectory.empty()) throw FileError(path, "holds no pose; allowed: one or more");
  return world.plan_along(trajectory);
}

void check_out(const std::string& out) {
  std::error_code ignored;
  if (fs::exists(out, ignored) && !fs::is_empty(out, ignored)) {
    throw FileError(out, "is there already and not empty; allowed: a new folder");
  }
}

/// What the robot saw, and where it truly was.
recordings::RunMoment make_moment(const DatasetEntry& entry, const Image& picture,
                                  const PanoramaReader& panoramas, std::size_t number) {
  recordings::RunMoment moment{
      .stamp_s = entry.stamp_s.value_or(static_cast<double>(number)),
      .picture = picture,
      .panorama = panoramas.convert(picture.view(), entry.tilt.value_or(Tilt{})),
      .odometry = entry.odometry,
      .tilt = entry.tilt,
      .truth = entry.pose};
  moment.pose = Pose2{entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad};
  return moment;
}

ExitCode simulate(const Arguments& arguments, SimulateArguments wanted, Session& session) {
  if (wanted.ros2 ? !wanted.out.empty() : wanted.out.size() != 1) {
    throw UsageError(wanted.ros2 ? "--ros2 makes no data set; leave OUT away"
                                 : "OUT is missing or given twice: a folder for the data set");
  }
  const std::string out = wanted.ros2 ? "" : wanted.out.front();
  apply_shorthands(arguments, wanted);
  if (!wanted.ros2) check_out(out);
  const simulation::SimulatedWorld world(wanted.scene, wanted.simulation, typed_options(arguments),
                                         session.executor());
  for (const auto& warning : world.scene().warnings) session.note("warning: " + warning);
  if (wanted.ros2) return wanted.robot.run(world, session);
  const auto poses = wanted.trajectory ? poses_of_file(*wanted.trajectory, world) : world.plan();
  const bool with_path = wanted.trajectory.has_value() ||
                         world.options().recording.path != simulation::RecordingPath::random;
  RunRecord record(wanted.record, {}, false, session, {});
  const PanoramaReader panoramas(world.source(), {});
  std::size_t number = 0;
  Progress progress(session, "rendering", poses.size());
  const auto dataset =
      simulation::record_dataset(world, out, poses, with_path, session.executor(),
                                 [&](const DatasetEntry& entry, const Image& picture) {
                                   if (record.wanted())
                                     record.add(make_moment(entry, picture, panoramas, number));
                                   ++number;
                                   progress.advance();
                                 });
  progress.clear();
  record.close();
  if (session.json()) {
    session.print(json_line(ordered_json{{"dataset", out},
                                         {"scene", world.scene().name},
                                         {"views", dataset.entries.size()},
                                         {"free_area_m2", world.free_space().area_m2()},
                                         {"warnings", world.scene().warnings}}));
  } else {
    session.print(session.strong(std::to_string(dataset.entries.size())) + " views of " +
                  world.scene().name + " in " + out);
    session.suggest({"panonav", "memorise", out, "NAME.panonav"});
  }
  return ExitCode::done;
}

Run declare_simulate_verb(Arguments& arguments) {
  auto wanted = std::make_shared<SimulateArguments>();
  const auto scenes = simulation::scene_names();
  std::string names;
  for (const auto name : scenes) names += (names.empty() ? "" : ", ") + std::string(name);
  arguments.positional("SCENE", wanted->scene,
                       "Built-in scene (" + names + "), Gazebo world (.world, .sdf) or mesh file",
                       {scenes.begin(), scenes.end()});
  arguments.optional_positionals("OUT", wanted->out, "Folder for the data set; new or empty");
  arguments.flag("--ros2", wanted->ros2,
                 "No data set: a robot in the scene that ROS 2 sees and drives");
  arguments.option("--grid METRES", wanted->grid_m,
                   "Short for --path grid --spacing-m: all free places of a grid");
  arguments.option("--random N", wanted->random,
                   "Short for --path random --poses: random places and headings");
  arguments.option("--trajectory FILE", wanted->trajectory,
                   "Poses of a trajectory file (TUM text or CSV)");
  declare_record(arguments, wanted->record);
  arguments.uncommon({"--record"});
  declare_simulation(arguments, wanted->simulation);
  wanted->robot.declare(arguments, [wanted] { return wanted->ros2; });
  arguments.common({"--path", "--spacing-m", "--poses", "--kind", "--seed", "--light"});
  const auto path = [wanted] {
    return wanted->random ? simulation::RecordingPath::random : wanted->simulation.recording.path;
  };
  arguments.used_only(
      {"[recording]"}, [wanted] { return !wanted->trajectory; },
      "with --trajectory, which says places and times");
  arguments.used_only(
      {"--spacing-m"}, [wanted] { return !wanted->grid_m; }, "with --grid, which is the spacing");
  arguments.used_only(
      {"--poses"}, [wanted] { return !wanted->random; }, "with --random, which is their number");
  arguments.used_only(
      {"--poses"},
      [path] {
        return path() == simulation::RecordingPath::walk ||
               path() == simulation::RecordingPath::random;
      },
      "without --path walk or random");
  arguments.used_only(
      {"--spacing-m", "--speed-m-s", "[odometry]"},
      [wanted, path] { return wanted->trajectory || path() != simulation::RecordingPath::random; },
      "on random places, which are no way");
  arguments.used_only(
      {"--heading-rad"},
      [wanted, path, &arguments] {
        return arguments.given("recording", "heading")
                   ? wanted->simulation.recording.heading == simulation::RecordingHeading::fixed
                   : path() == simulation::RecordingPath::grid ||
                         path() == simulation::RecordingPath::zigzag;
      },
      "without --heading fixed");
  return [wanted, &arguments](Session& session) { return simulate(arguments, *wanted, session); };
}

}  // namespace

Verb simulate_verb() {
  return {"simulate", "Render a data set of a simulated robot with a mirror camera",
          "Every way but random places comes with stamps and noisy odometry. The same options and "
          "seeds give the same pictures on one kind of processor.",
          "  panonav simulate office memory_run --grid 0.25\n"
          "  panonav simulate office query_run --random 20 --seed 7\n"
          "  panonav simulate house.world house_run --grid 0.5 --kind panorama\n"
          "  panonav simulate office --ros2 --kind panorama",
          declare_simulate_verb};
}

}  // namespace panonav::command
