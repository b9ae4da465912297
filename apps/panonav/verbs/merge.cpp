#include "panonav/pipeline/memory_merge.hpp"

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

namespace {

struct MergeArguments {
  std::string first;
  std::string second;
  std::string memory;
  SessionAlignmentOptions alignment;
};

ordered_json to_json(const std::optional<SessionAlignment>& alignment) {
  if (!alignment) return nullptr;
  const Pose2& pose = alignment->first_from_second;
  return {{"x_m", pose.x_m},
          {"y_m", pose.y_m},
          {"heading_rad", pose.heading_rad},
          {"places", alignment->places},
          {"expected_places", alignment->expected_places},
          {"confirmed_places", alignment->confirmed_places},
          {"other_places", alignment->other_places},
          {"matches", alignment->matches.size()},
          {"refuted", alignment->refuted}};
}

ExitCode merge(const MergeArguments& arguments, Session& session) {
  const MergedMemory merged = [&] {
    const auto views = [](const std::string& path) {
      return MemoryFile::open(path, Access::read_only).info().views;
    };
    Progress progress(session, "merging", views(arguments.first) + views(arguments.second));
    return merge_memories(arguments.first, arguments.second, arguments.memory, arguments.alignment,
                          {}, [&] { progress.advance(); });
  }();
  session.set_length_unit(read_length_unit(MemoryFile::open(arguments.memory, Access::read_only)));
  const bool has_nothing_new =
      merged.views == MemoryFile::open(arguments.first, Access::read_only).info().views;
  const ExitCode exit_code = merged.alignment || has_nothing_new || !merged.has_shared_floor
                                 ? ExitCode::done
                                 : ExitCode::no_answer;
  if (session.json()) {
    session.print(
        session.json_line(ordered_json{{"memory", arguments.memory},
                                       {"views", merged.views},
                                       {"shared", merged.shared},
                                       {"renamed", merged.renamed},
                                       {"alignment", to_json(merged.alignment)},
                                       {"connected_components", merged.connected_components},
                                       {"without_position", merged.without_position}}));
    return exit_code;
  }
  if (has_nothing_new) {
    session.print("All views of " + arguments.second + " are in " + arguments.first + " already.");
  } else if (merged.alignment) {
    const Pose2& pose = merged.alignment->first_from_second;
    session.print(
        session.bold("joined") + " by " + format_count(merged.alignment->places, "place") +
        " in common; of " + format_count(merged.alignment->expected_places, "place") +
        " where both maps overlap, " + std::to_string(merged.alignment->confirmed_places) +
        " match. " + arguments.second + " lies at x " + session.format_length(pose.x_m, 2) +
        ", y " + session.format_length(pose.y_m, 2) + ", rotated by " +
        format_fixed(degrees(pose.heading_rad), 1) + " degrees, in the frame of " +
        arguments.first + ".");
  } else if (!merged.has_shared_floor) {
    session.print("The memories are of different floors, each of which keeps its positions.");
  } else {
    session.print(session.red("no place in common was found") +
                  ": the map contains both as parts that are not connected" +
                  (merged.without_position > 0
                       ? ", and " + format_count(merged.without_position, "view") + " of " +
                             arguments.second +
                             " have no position, because their positions are in another frame"
                       : "") +
                  ".");
  }
  session.print(
      arguments.memory + " holds " + format_count(merged.views, "view") +
      (merged.shared > 0 ? "; " + std::to_string(merged.shared) + " in both memories" : "") +
      (merged.renamed > 0 ? "; " + std::to_string(merged.renamed) +
                                " were renamed, because another view has the same name"
                          : "") +
      ".");
  session.suggest({"panonav", "prune", arguments.memory, "--dry-run"}, "To list redundant views:");
  return exit_code;
}

Run declare_merge(Arguments& arguments) {
  auto values = std::make_shared<MergeArguments>();
  arguments.positional("FIRST", values->first,
                       "Memory file whose coordinate frame the new memory uses");
  arguments.positional("SECOND", values->second,
                       "Memory file whose views are added to those of FIRST");
  arguments.required_option("-o,--out MEMORY", values->memory, "New memory file");
  arguments.options("merge", values->alignment);
  arguments.show_in_help({"--min-places"});
  arguments.declare_outputs({"--out"});
  arguments.explain_interruption(
      "The new memory was not written. To start over, run the same command again.");
  return [values](Session& session) { return merge(*values, session); };
}

}  // namespace

Verb merge_verb() {
  return {"merge",
          VerbGroup::several_robots,
          "Merge two memories that have places in common",
          "Common places are found by their appearance. The maps of both memories are joined at "
          "these places and optimised together, in the coordinate frame of FIRST. If no common "
          "place is found, the new memory contains both maps as parts that are not connected, and "
          "the exit "
          "code is 1. A view that both memories contain is stored only once. The files FIRST and "
          "SECOND are not changed.",
          "  panonav merge monday.panonav tuesday.panonav -o both.panonav\n"
          "  panonav merge monday.panonav tuesday.panonav -o both.panonav --json",
          declare_merge};
}

}  // namespace panonav::command
