#include <atomic>
#include <memory>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#ifdef PANONAV_COMMAND_SPEAKS_DDS
#include "ros2/localisation_node.hpp"
#endif

namespace panonav::command {

namespace {

#ifdef PANONAV_COMMAND_SPEAKS_DDS

struct Ros2Arguments {
  std::vector<std::string> remappings;
  std::string memory;
  std::optional<int> domain;
  ros2::LocalisationNodeSetup setup;
};

std::map<std::string, std::string> remappings_of(const std::vector<std::string>& words) {
  std::map<std::string, std::string> remappings;
  for (const std::string& text : words) {
    const std::size_t at = text.find(":=");
    if (at == 0 || at == std::string::npos || at + 2 == text.size()) {
      throw UsageError("'" + readable_line(text) +
                       "' is no remapping; allowed: FROM:=TO, as image:=/camera/image");
    }
    remappings.insert_or_assign(text.substr(0, at), text.substr(at + 2));
  }
  return remappings;
}

ExitCode run_node(Ros2Arguments& wanted, Session& session) {
  wanted.setup.memory = wanted.memory;
  wanted.setup.participant.domain = wanted.domain;
  wanted.setup.participant.remappings = remappings_of(wanted.remappings);
  std::atomic<bool> stopped = false;
  std::atomic<ros2::LocalisationNode*> running = nullptr;
  const StopSignals signals([&] {
    stopped = true;
    if (auto* const node = running.load()) node->stop();
  });
  ros2::LocalisationNode node(wanted.setup, [&](const std::string& line) { session.note(line); });
  running = &node;
  if (stopped) return ExitCode::done;
  session.note("panonav ros2: " + wanted.memory + " is loaded; the node listens");
  node.run();
  running = nullptr;
  const auto counts = node.counts();
  session.note(std::to_string(counts.pictures) + " pictures, localised at " +
               std::to_string(counts.localised) + ", " + std::to_string(counts.dropped) +
               " came too fast and were dropped, " + std::to_string(counts.notes) + " warnings");
  return ExitCode::done;
}

Run declare_ros2(Arguments& arguments) {
  auto wanted = std::make_shared<Ros2Arguments>();
  auto& setup = wanted->setup;
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.optional_positionals("REMAPPING", wanted->remappings,
                                 "Names of topics, FROM:=TO: image:=/camera/image_raw");
  arguments.option("--node-name NAME", setup.participant.node, "Name of the node");
  arguments.option("--namespace NAME", setup.participant.name_space, "Namespace of the node");
  arguments.option("--domain-id", wanted->domain, 0,
                   "DDS domain; default: ROS_DOMAIN_ID of the environment, or 0");
  arguments.option("--map-frame NAME", setup.frames.map, "Frame of the memory's positions");
  arguments.option("--odom-frame NAME", setup.frames.odom, "Frame of the odometry");
  arguments.option("--base-frame NAME", setup.frames.base, "Frame of the robot");
  arguments.options("ros2", setup.node);
  arguments.options("monte_carlo", setup.tracker.filter);
  arguments.options("odometry", setup.tracker.odometry, "odometry");
  arguments.options("base", setup.navigator.base);
  arguments.common({"--motion", "--pictures", "--use-sim-time"});
  return [wanted](Session& session) { return run_node(*wanted, session); };
}

#else

Run declare_ros2(Arguments& arguments) {
  auto words = std::make_shared<std::vector<std::string>>();
  arguments.optional_positionals("WORDS", *words, "Not used");
  return [words](Session&) -> ExitCode {
    throw Error(
        "this panonav was built without Cyclone DDS; install cyclonedds-dev and build it again");
  };
}

#endif

}  // namespace

Verb ros2_verb() {
  return {"ros2", "Localise a robot as a ROS 2 node, without an installed ROS",
          "Listens to image, odom, initialpose and goal_pose; sends map -> odom on /tf, and pose, "
          "particles, references, best match and diagnostics, on the way to a goal cmd_vel. Any "
          "ROS 2 distribution on the network sees the "
          "node (docs/ros2.md). Ends on Ctrl-C.",
          "  panonav ros2 office.panonav image:=/camera/image_raw\n"
          "  panonav ros2 office.panonav --pictures compressed --use-sim-time true",
          declare_ros2};
}

}  // namespace panonav::command
