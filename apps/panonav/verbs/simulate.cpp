#include <filesystem>
#include <memory>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "verbs/run_record.hpp"
#include "verbs/simulated_recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct SimulateArguments {
  std::string scene;
  std::string out;
  std::optional<double> grid_m;
  std::optional<std::uint64_t> random;
  std::optional<std::string> trajectory;
  std::optional<std::string> record;
  SimulationArguments simulation;
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
    recording.path = RecordingPath::grid;
    recording.spacing_m = *wanted.grid_m;
  }
  if (wanted.random) {
    constexpr std::uint64_t most = 1000000;
    if (*wanted.random == 0 || *wanted.random > most) {
      throw UsageError("--random is " + std::to_string(*wanted.random) + "; allowed: 1 to " +
                       std::to_string(most));
    }
    recording.path = RecordingPath::random;
    recording.poses = static_cast<int>(*wanted.random);
  }
  if (arguments.given("recording", "heading")) return;
  switch (recording.path) {
    case RecordingPath::grid:
    case RecordingPath::zigzag:
      recording.heading = RecordingHeading::fixed;
      break;
    case RecordingPath::tour:
    case RecordingPath::walk:
      recording.heading = RecordingHeading::path;
      break;
    case RecordingPath::random:
      recording.heading = RecordingHeading::random;
      break;
  }
}

std::vector<RecordedPose> poses_of_file(const std::string& path,
                                        const SimulationArguments& wanted) {
  std::vector<RecordedPose> recorded;
  std::vector<Pose2> poses;
  for (const auto& stamped : read_trajectory(path)) {
    recorded.push_back({stamped.stamp_s, stamped.pose, {}});
    poses.push_back(stamped.pose);
  }
  if (recorded.empty()) throw FileError(path, "holds no pose; allowed: one or more");
  const auto odometry = simulate_odometry(poses, wanted.odometry,
                                          static_cast<std::uint64_t>(wanted.simulation.scene.seed));
  for (std::size_t i = 0; i < recorded.size(); ++i) recorded[i].odometry = odometry[i];
  return recorded;
}

void check_out(const std::string& out) {
  std::error_code ignored;
  if (fs::exists(out, ignored) && !fs::is_empty(out, ignored)) {
    throw FileError(out, "is there already and not empty; allowed: a new folder");
  }
}

/// What the robot saw, and where it truly was.
RunMoment moment_of(const DatasetEntry& entry, const Image& picture,
                    const PanoramaReader& panoramas, std::size_t number) {
  RunMoment moment{.stamp_s = entry.stamp_s.value_or(static_cast<double>(number)),
                   .picture = picture,
                   .panorama = panoramas.convert(picture.view(), entry.tilt.value_or(Tilt{})),
                   .odometry = entry.odometry,
                   .tilt = entry.tilt,
                   .truth = entry.pose};
  moment.pose = Pose2{entry.pose->x_m, entry.pose->y_m, *entry.pose->heading_rad};
  return moment;
}

ExitCode simulate(const Arguments& arguments, SimulateArguments wanted, Session& session) {
  apply_shorthands(arguments, wanted);
  check_out(wanted.out);
  const SimulatedWorld world(
      wanted.scene, wanted.simulation,
      [&](const std::string& section, const std::string& name) {
        return arguments.given(section, name);
      },
      session.executor());
  for (const auto& warning : world.scene().warnings) session.note("warning: " + warning);
  const auto& settled = world.arguments();
  const auto poses =
      wanted.trajectory
          ? poses_of_file(*wanted.trajectory, settled)
          : plan_recording(world.scene(), world.free_space(), settled.recording, settled.odometry,
                           static_cast<std::uint64_t>(settled.simulation.scene.seed));
  const bool with_path =
      wanted.trajectory.has_value() || settled.recording.path != RecordingPath::random;
  RunRecord record(wanted.record, {}, false, session);
  const PanoramaReader panoramas(world.source(), {});
  std::size_t number = 0;
  Progress progress(session, "rendering", poses.size());
  const auto dataset = record_dataset(world, wanted.out, poses, with_path, session.executor(),
                                      [&](const DatasetEntry& entry, const Image& picture) {
                                        if (record.wanted())
                                          record.add(moment_of(entry, picture, panoramas, number));
                                        ++number;
                                        progress.advance();
                                      });
  progress.clear();
  record.close();
  if (session.json()) {
    session.print(json_line(ordered_json{{"dataset", wanted.out},
                                         {"scene", world.scene().name},
                                         {"views", dataset.entries.size()},
                                         {"free_area_m2", world.free_space().area_m2()},
                                         {"warnings", world.scene().warnings}}));
  } else {
    session.print(session.strong(std::to_string(dataset.entries.size())) + " views of " +
                  world.scene().name + " in " + wanted.out);
    session.suggest({"panonav", "memorise", wanted.out, "NAME.panonav"});
  }
  return ExitCode::done;
}

Run declare_simulate_verb(Arguments& arguments) {
  auto wanted = std::make_shared<SimulateArguments>();
  const auto scenes = scene_names();
  std::string names;
  for (const auto name : scenes) names += (names.empty() ? "" : ", ") + std::string(name);
  arguments.positional("SCENE", wanted->scene,
                       "Built-in scene (" + names + "), Gazebo world (.world, .sdf) or mesh file",
                       {scenes.begin(), scenes.end()});
  arguments.positional("OUT", wanted->out, "Folder for the data set; new or empty");
  arguments.option("--grid METRES", wanted->grid_m,
                   "Short for --path grid --spacing-m: all free places of a grid");
  arguments.option("--random N", wanted->random,
                   "Short for --path random --poses: random places and headings");
  arguments.option("--trajectory FILE", wanted->trajectory,
                   "Poses of a trajectory file (TUM text or CSV)");
  declare_record(arguments, wanted->record);
  arguments.uncommon({"--record"});
  declare_simulation(arguments, wanted->simulation);
  arguments.common(
      {"--path", "--spacing-m", "--poses", "--kind", "--seed", "--light", "--moved-objects"});
  const auto path = [wanted] {
    return wanted->random ? RecordingPath::random : wanted->simulation.recording.path;
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
      [path] { return path() == RecordingPath::walk || path() == RecordingPath::random; },
      "without --path walk or random");
  arguments.used_only(
      {"--spacing-m", "--speed-m-s", "[odometry]"},
      [wanted, path] { return wanted->trajectory || path() != RecordingPath::random; },
      "on random places, which are no way");
  arguments.used_only(
      {"--heading-rad"},
      [wanted, path, &arguments] {
        return arguments.given("recording", "heading")
                   ? wanted->simulation.recording.heading == RecordingHeading::fixed
                   : path() == RecordingPath::grid || path() == RecordingPath::zigzag;
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
          "  panonav simulate house.world house_run --grid 0.5 --kind panorama",
          declare_simulate_verb};
}

}  // namespace panonav::command
