#include <algorithm>
#include <atomic>

#include "cli/option_values.hpp"
#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav_ros2/localisation_node.hpp"
#include "panonav_ros2/ros_arguments.hpp"
#include "runs/picture_layout.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

struct Ros2Arguments {
  std::vector<std::string> remappings;
  std::string memory;
  std::optional<int> domain;
  bool teach = false;
  bool explore = false;
  std::optional<std::string> route;
  PictureArguments pictures;
  ros2::TeacherOptions teacher;
  ExplorationOptions exploration;
  ros2::LocalisationNodeSetup setup;
};

std::string parameter_name(const ArgumentInfo& info) {
  std::string name = to_lower_case(info.name.substr(info.positional() ? 0 : 2));
  std::ranges::replace(name, '-', '_');
  return name;
}

/// Returns the word after a flag, or the default value of the flag.
std::string find_value_or_default(std::span<const std::string> words,
                                  std::span<const ArgumentInfo> infos, const std::string& flag) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == flag && i + 1 < words.size()) return words[i + 1];
    if (words[i].starts_with(flag + "=")) return words[i].substr(flag.size() + 1);
  }
  return std::ranges::find(infos, flag, &ArgumentInfo::name)->default_value;
}

/// Converts the arguments of `ros2 run` and launch files to those of the command line: parameters
/// become options.
std::vector<std::string> translate_ros_arguments(std::span<const std::string> typed,
                                                 std::span<const ArgumentInfo> infos) {
  const auto ros_arguments =
      ros2::read_ros_arguments(typed, find_value_or_default(typed, infos, "--node-name"),
                               find_value_or_default(typed, infos, "--namespace"));
  std::vector<std::string> words = ros_arguments.words;
  const auto is_typed = [&](const std::string& flag) {
    return std::ranges::any_of(ros_arguments.words, [&](const std::string& word) {
      return word == flag || word.starts_with(flag + "=");
    });
  };
  std::vector<std::string> names;
  for (const auto& info : infos) names.push_back(parameter_name(info));
  for (const auto& [name, values, where] : ros_arguments.parameters) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      const std::vector<std::string_view> known(names.begin(), names.end());
      throw UsageError(where + ": the node has no parameter '" + to_readable_line(name) + "'" +
                       suggest_name(name, known));
    }
    const auto& info = infos[static_cast<std::size_t>(found - names.begin())];
    if (info.name == "MEMORY") {
      const bool has_memory = std::ranges::any_of(
          ros_arguments.words, [](const std::string& word) { return word.ends_with(".panonav"); });
      if (!has_memory) words.insert(words.begin(), values.begin(), values.end());
    } else if (info.positional()) {
      words.insert(words.end(), values.begin(), values.end());
    } else if (is_typed(info.name)) {
      continue;
    } else if (info.value.empty()) {
      if (values.size() != 1 || (values[0] != "true" && values[0] != "false")) {
        throw UsageError(where + ": " + name + " is '" + to_readable_line(join_texts(values)) +
                         "'; allowed: true, false");
      }
      if (values[0] == "true") words.push_back(info.name);
    } else {
      words.push_back(info.name);
      words.insert(words.end(), values.begin(), values.end());
    }
  }
  for (const auto& [from, to] : ros_arguments.remappings) {
    if (from == "__node" || from == "__ns") {
      const std::string flag = from == "__node" ? "--node-name" : "--namespace";
      if (is_typed(flag)) throw UsageError(flag + " and " + from + " cannot be combined");
      words.insert(words.end(), {flag, to});
    } else {
      words.push_back(from + ":=" + to);
    }
  }
  return words;
}

ExitCode run_node(Ros2Arguments& arguments, Session& session) {
  arguments.setup.memory = arguments.memory;
  arguments.setup.participant.domain = arguments.domain;
  for (const std::string& text : arguments.remappings) {
    const auto [from, to] = ros2::parse_remapping(text);
    arguments.setup.participant.remappings.insert_or_assign(from, to);
  }
  if (arguments.teach && arguments.explore) {
    throw UsageError("--teach and --explore cannot be combined; choose one");
  }
  const bool makes_memory = arguments.teach || arguments.explore;
  if (makes_memory) {
    if (arguments.pictures.kind == "pinhole") {
      throw UsageError(
          "--kind pinhole cannot be used with --teach or --explore; a memory needs images of all "
          "azimuths");
    }
    const auto pictures = make_picture_source(arguments.pictures, session);
    if (!pictures) throw UsageError("set --kind to the type of the images");
    note_default_band(*pictures, elevation_flag, session);
    arguments.teacher.pictures = *pictures;
    arguments.teacher.route = arguments.route;
  } else if (arguments.pictures.kind) {
    arguments.setup.tracker.source = make_picture_source(arguments.pictures, session);
  }
  if (arguments.teach) arguments.setup.teacher = arguments.teacher;
  if (arguments.explore) {
    const auto& made = arguments.teacher;
    arguments.setup.exploration = ros2::ExplorationSetup{made.pictures, arguments.exploration,
                                                         made.signature, made.preprocessing};
  }
  std::atomic<bool> stopped = false;
  std::atomic<ros2::LocalisationNode*> running = nullptr;
  const StopSignals signals([&] {
    stopped = true;
    if (auto* const node = running.load()) node->stop();
  });
  ros2::LocalisationNode node(arguments.setup,
                              [&](const std::string& line) { session.note(line); });
  running = &node;
  if (stopped) return ExitCode::done;
  session.note("panonav ros2: " + arguments.memory +
               (makes_memory ? " is being made" : " is loaded") + "; the node is ready");
  node.run();
  running = nullptr;
  const auto counts = node.counts();
  session.note(format_count(counts.pictures, "image") + ", localised at " +
               std::to_string(counts.localised) + ", " +
               (makes_memory ? format_count(counts.taught, "view") + " stored, " : "") +
               std::to_string(counts.dropped) + " dropped because of too fast a rate, " +
               format_count(counts.notes, "warning"));
  return ExitCode::done;
}

Run declare_ros2(Arguments& arguments) {
  auto values = std::make_shared<Ros2Arguments>();
  auto& setup = values->setup;
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.optional_positionals(
      "REMAPPING", values->remappings,
      "New name of a topic as FROM:=TO, for example image:=/camera/image_raw");
  arguments.flag("--teach", values->teach,
                 "Make the new memory file MEMORY from a first drive; the message 'finish' on the "
                 "topic ~/command ends the drive");
  arguments.flag("--explore", values->explore,
                 "Make the new memory file MEMORY by an exploration: the message 'explore' on the "
                 "topic ~/command starts it, and 'cancel' ends it");
  arguments.option("--route NAME", values->route,
                   "With --teach: also record the drive as a route with this name");
  arguments.option("--node-name NAME", setup.participant.node, "Name of the node");
  arguments.option("--namespace NAME", setup.participant.name_space, "Namespace of the node");
  arguments.option(
      "--domain-id", values->domain, 0,
      "DDS domain; default: the environment variable ROS_DOMAIN_ID, or 0 if it is not set");
  arguments.option("--map-frame NAME", setup.frames.map,
                   "Name of the frame of the memory's positions");
  arguments.option("--odom-frame NAME", setup.frames.odom, "Name of the frame of the odometry");
  arguments.option("--base-frame NAME", setup.frames.base, "Name of the frame of the robot");
  arguments.allow_in_config_files(
      "ros2", {"--node-name", "--namespace", "--map-frame", "--odom-frame", "--base-frame"});
  values->pictures.takes_narrow = true;
  declare_picture_layout(arguments, values->pictures);
  arguments.options("signature", values->teacher.signature);
  arguments.options("preprocessing", values->teacher.preprocessing);
  arguments.options("ros2", setup.node);
  arguments.options("exploration", values->exploration);
  arguments.options("monte_carlo", setup.tracker.filter);
  arguments.options("odometry", setup.tracker.odometry.emplace(), "odometry");
  arguments.options("base", setup.navigator.base);
  arguments.reject_options_unless(
      {"--columns-run", "--forward-column", "--elevation-deg", "[signature]", "[preprocessing]"},
      [values] { return values->teach || values->explore; }, "without --teach or --explore");
  arguments.reject_options_unless(
      {"--kind", "--camera", "--field-of-view"},
      [values] { return values->teach || values->explore || values->pictures.kind == "pinhole"; },
      "without --teach or --explore, except --kind pinhole");
  arguments.reject_options_unless(
      {"--route"}, [values] { return values->teach; }, "without --teach");
  arguments.reject_options_unless(
      {"[exploration]"}, [values] { return values->explore; }, "without --explore");
  arguments.reject_options_unless(
      {"--robot-radius-m"},
      [values] { return values->explore || values->setup.node.camera_height_m > 0.0; },
      "without --explore or --camera-height-m");
  arguments.show_in_help({"--motion", "--pictures", "--use-sim-time"});
  arguments.hide_from_help({"--node-name", "--domain-id", "--map-frame", "--odom-frame",
                            "--base-frame", "--field-of-view"});
  return [values](Session& session) { return run_node(*values, session); };
}

}  // namespace

Verb ros2_verb() {
  return {"ros2",
          VerbGroup::localisation,
          "Run a ROS 2 node that localises a robot",
          "The node reads the topics image, odom, initialpose and goal_pose. The node publishes "
          "the transform map -> odom on /tf, and the pose, particles, reference views, best match "
          "and diagnostics. While the robot drives to a goal, the node also publishes cmd_vel. ROS "
          "need not be installed on this computer; computers with any ROS 2 distribution on the "
          "network can use the node (docs/ros2.md). Ctrl-C stops the node.",
          "  panonav ros2 office.panonav image:=/camera/image_raw\n"
          "  panonav ros2 new.panonav --teach --kind mirror --camera mirror.toml --elevation-deg "
          "-25 35\n"
          "  panonav ros2 new.panonav --explore --kind mirror --camera mirror.toml\n"
          "  panonav ros2 office.panonav --pictures compressed --use-sim-time true\n"
          "  panonav ros2 office.panonav --kind pinhole --camera camera_info.yaml",
          declare_ros2,
          {},
          translate_ros_arguments};
}

}  // namespace panonav::command
