#include <cmath>
#include <filesystem>

#include "cli/option_values.hpp"
#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
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

/// Sets the path for --grid or --random and the default heading. Throws UsageError if several of
/// --grid, --random, --trajectory and --path are set.
void apply_path_options(const Arguments& declared, SimulateArguments& arguments) {
  const int path_count =
      (arguments.grid_m ? 1 : 0) + (arguments.random ? 1 : 0) + (arguments.trajectory ? 1 : 0);
  if (path_count > 1 || (path_count == 1 && declared.is_set("recording", "path"))) {
    throw UsageError("--grid, --random, --trajectory and --path cannot be combined; choose one");
  }
  auto& recording = arguments.simulation.recording;
  if (arguments.grid_m) {
    if (!(*arguments.grid_m >= 0.001 &&
          *arguments.grid_m <= 1000.0)) {  // same range as --spacing-m
      throw UsageError("--grid is " + to_text(*arguments.grid_m) +
                       "; allowed: 0.001 to 1000 metres");
    }
    recording.path = simulation::RecordingPath::grid;
    recording.spacing_m = *arguments.grid_m;
  }
  if (arguments.random) {
    constexpr std::uint64_t max_poses = 1000000;
    if (*arguments.random == 0 || *arguments.random > max_poses) {
      throw UsageError("--random is " + std::to_string(*arguments.random) + "; allowed: 1 to " +
                       std::to_string(max_poses));
    }
    recording.path = simulation::RecordingPath::random;
    recording.poses = static_cast<int>(*arguments.random);
  }
  if (declared.is_set("recording", "heading")) return;
  recording.heading = simulation::default_heading(recording.path);
}

std::vector<simulation::RecordedPose> read_poses(const std::string& path,
                                                 const simulation::SimulatedWorld& world) {
  const auto trajectory = read_trajectory(path);
  if (trajectory.empty()) throw FileError(path, "contains no pose; allowed: one or more");
  return world.plan_along(trajectory);
}

void require_new_folder(const std::string& out) {
  std::error_code ignored;
  if (fs::exists(out, ignored) && !fs::is_empty(out, ignored)) {
    throw FileError(out, "already exists and is not empty; allowed: a new folder");
  }
}

/// Makes the moment of an image with the true pose.
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

ExitCode simulate(const Arguments& declared, SimulateArguments arguments, Session& session) {
  if (arguments.ros2 ? !arguments.out.empty() : arguments.out.size() != 1) {
    throw UsageError(arguments.ros2 ? "--ros2 does not make a data set; leave out OUT"
                                    : "one folder OUT for the data set is required");
  }
  const std::string out = arguments.ros2 ? "" : arguments.out.front();
  apply_path_options(declared, arguments);
  if (!arguments.ros2) require_new_folder(out);
  const simulation::SimulatedWorld world(
      arguments.scene, arguments.simulation, make_option_lookup(declared), session.executor(),
      [&](const std::string& warning) { session.note("warning: " + warning); });
  if (arguments.ros2) return arguments.robot.run(world, session);
  const auto poses = arguments.trajectory ? read_poses(*arguments.trajectory, world) : world.plan();
  auto warnings = world.scene().warnings;
  if (arguments.trajectory) {
    const std::string impossible = world.describe_impossible_poses(poses);
    if (!impossible.empty()) {
      warnings.push_back(*arguments.trajectory + ": " + impossible);
      session.note("warning: " + warnings.back());
    }
  }
  const bool with_path = arguments.trajectory.has_value() ||
                         world.options().recording.path != simulation::RecordingPath::random;
  RunRecord record(arguments.record, {}, false, session, {});
  const PanoramaReader panoramas(world.source(), {});
  std::size_t number = 0;
  Progress progress(session, "rendering", poses.size());
  const auto dataset =
      simulation::record_dataset(world, out, poses, with_path, session.executor(),
                                 [&](const DatasetEntry& entry, const Image& picture) {
                                   if (record.is_active())
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
                                         {"warnings", warnings}}));
  } else {
    session.print(session.bold(format_count(dataset.entries.size(), "view")) + " of " +
                  world.scene().name + " in " + out);
    session.suggest({"panonav", "memorise", "NAME.panonav", out});
  }
  return ExitCode::done;
}

Run declare_simulate_verb(Arguments& arguments) {
  auto values = std::make_shared<SimulateArguments>();
  const auto scenes = simulation::scene_names();
  arguments.positional(
      "SCENE", values->scene,
      "Built-in scene (" + join_texts(scenes) + "), Gazebo world (.world, .sdf) or mesh file",
      {scenes.begin(), scenes.end()});
  arguments.optional_positionals("OUT", values->out, "New or empty folder for the data set");
  arguments.flag("--ros2", values->ros2,
                 "Instead of making a data set, simulate a ROS 2 robot that publishes images and "
                 "obeys velocity commands");
  arguments.option("--grid METRES", values->grid_m,
                   "Take images at all points of a grid that are free of obstacles; same as --path "
                   "grid --spacing-m METRES");
  arguments.option("--random N", values->random,
                   "Take images at N random poses; same as --path random --poses N");
  arguments.option("--trajectory FILE", values->trajectory,
                   "Take images at the poses of this trajectory (TUM text or CSV)");
  declare_record(arguments, values->record);
  arguments.hide_from_help({"--record"});
  declare_simulation(arguments, values->simulation);
  values->robot.declare(arguments, [values] { return values->ros2; });
  arguments.show_in_help({"--path", "--spacing-m", "--poses", "--kind", "--seed", "--light"});
  const auto path = [values] {
    return values->random ? simulation::RecordingPath::random : values->simulation.recording.path;
  };
  arguments.reject_options_unless(
      {"[recording]"}, [values] { return !values->trajectory; },
      "with --trajectory, which gives places and times");
  arguments.reject_options_unless(
      {"--spacing-m"}, [values] { return !values->grid_m; }, "with --grid, which sets the spacing");
  arguments.reject_options_unless(
      {"--poses"}, [values] { return !values->random; }, "with --random, which sets the number");
  arguments.reject_options_unless(
      {"--poses"},
      [path] {
        return path() == simulation::RecordingPath::walk ||
               path() == simulation::RecordingPath::random;
      },
      "without --path walk or random");
  arguments.reject_options_unless(
      {"--spacing-m", "--speed-m-s", "[odometry]"},
      [values, path] { return values->trajectory || path() != simulation::RecordingPath::random; },
      "with random places");
  arguments.reject_options_unless(
      {"--heading-rad"},
      [values, path, &arguments] {
        return arguments.is_set("recording", "heading")
                   ? values->simulation.recording.heading == simulation::RecordingHeading::fixed
                   : path() == simulation::RecordingPath::grid ||
                         path() == simulation::RecordingPath::zigzag;
      },
      "without --heading fixed");
  arguments.declare_outputs({"OUT"});
  return [values, &arguments](Session& session) { return simulate(arguments, *values, session); };
}

}  // namespace

Verb simulate_verb() {
  return {"simulate",
          VerbGroup::experiments,
          "Make a data set with the images of a simulated robot",
          "Each image has a time stamp and noisy odometry, unless the poses are random. The same "
          "options and seeds give the same images on the same type of processor.",
          "  panonav simulate office memory_run --grid 0.25\n"
          "  panonav simulate office query_run --random 20 --seed 7\n"
          "  panonav simulate house.world house_run --grid 0.5 --kind panorama\n"
          "  panonav simulate office --ros2 --kind panorama",
          declare_simulate_verb};
}

}  // namespace panonav::command
