#include "panonav/pipeline/memory_merge.hpp"

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::command {

namespace {

struct MergeArguments {
  std::string first;
  std::string second;
  std::string memory;
  SessionAlignmentOptions alignment;
};

ordered_json as_json(const std::optional<SessionAlignment>& alignment) {
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

ExitCode merge(const MergeArguments& wanted, Session& session) {
  const MergedMemory merged = [&] {
    const auto views = [](const std::string& path) {
      return MemoryFile::open(path, Access::read_only).info().views;
    };
    Progress progress(session, "merging", views(wanted.first) + views(wanted.second));
    return merge_memories(wanted.first, wanted.second, wanted.memory, wanted.alignment, {},
                          [&] { progress.advance(); });
  }();
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", wanted.memory},
                                         {"views", merged.views},
                                         {"shared", merged.shared},
                                         {"renamed", merged.renamed},
                                         {"alignment", as_json(merged.alignment)},
                                         {"connected_components", merged.connected_components},
                                         {"without_position", merged.without_position}}));
    return merged.alignment ? ExitCode::done : ExitCode::no_answer;
  }
  if (merged.alignment) {
    const Pose2& pose = merged.alignment->first_from_second;
    session.print(session.strong("joined") + " by " + std::to_string(merged.alignment->places) +
                  " places in common; of " + std::to_string(merged.alignment->expected_places) +
                  " places where both maps lie upon each other, " +
                  std::to_string(merged.alignment->confirmed_places) + " match. " + wanted.second +
                  " lies at x " + format_fixed(pose.x_m, 2) + " m, y " + format_fixed(pose.y_m, 2) +
                  " m, turned by " + format_fixed(degrees(pose.heading_rad), 1) +
                  " degrees, in the frame of " + wanted.first + ".");
  } else {
    session.print(session.bad("no place in common was found") +
                  ": the map keeps both as connected components" +
                  (merged.without_position > 0
                       ? ", and " + std::to_string(merged.without_position) + " views of " +
                             wanted.second + " have no position, as theirs is in another frame"
                       : "") +
                  ".");
  }
  session.print(wanted.memory + " holds " + std::to_string(merged.views) + " views" +
                (merged.shared > 0 ? "; " + std::to_string(merged.shared) + " were in both" : "") +
                (merged.renamed > 0 ? "; " + std::to_string(merged.renamed) +
                                          " got another name, as theirs was taken by another view"
                                    : "") +
                ".");
  session.suggest({"panonav", "prune", wanted.memory, "--dry-run"},
                  "To see which views have become redundant:");
  return merged.alignment ? ExitCode::done : ExitCode::no_answer;
}

Run declare_merge(Arguments& arguments) {
  auto wanted = std::make_shared<MergeArguments>();
  arguments.positional("FIRST", wanted->first, "Memory file whose frame is kept");
  arguments.positional("SECOND", wanted->second, "Memory file that is added to it");
  arguments.required_option("-o,--out MEMORY", wanted->memory, "New memory file");
  arguments.options("merge", wanted->alignment);
  arguments.common({"--min-places"});
  return [wanted](Session& session) { return merge(*wanted, session); };
}

}  // namespace

Verb merge_verb() {
  return {
      "merge", "Make one memory of two that have places in common",
      "Places in common are found by what they look like. The maps of both are joined there and "
      "optimised together, in the frame of FIRST. Where nothing in common is found, both stay "
      "connected components of one map, and the verb ends with exit code 1. Views with one name "
      "and one picture are kept once; neither file is changed.",
      "  panonav merge monday.panonav tuesday.panonav -o both.panonav\n"
      "  panonav merge monday.panonav tuesday.panonav -o both.panonav --json",
      declare_merge};
}

}  // namespace panonav::command
