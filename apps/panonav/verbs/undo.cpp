#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

struct UndoArguments {
  std::string memory;
  bool dry_run = false;
};

ExitCode undo(const UndoArguments& arguments, Session& session) {
  auto memory = MemoryFile::open(arguments.memory, Access::read_write);
  const auto what = memory.undoable();
  if (!what) {
    throw FileError(
        arguments.memory,
        "contains no change that can be reverted; allowed: after forget, prune, rename, "
        "scale and localise --update");
  }
  const LengthUnit unit_before = read_length_unit(memory);
  if (arguments.dry_run) {
    memory.require_undo_possible();
  } else {
    memory.undo();
  }
  const LengthUnit unit = read_length_unit(memory);
  const auto views = memory.info().views;
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"dry_run", arguments.dry_run},
                                         {"undone", *what},
                                         {"unit", unit == LengthUnit::metres ? "m" : "view_steps"},
                                         {"views", views}}));
    return ExitCode::done;
  }
  session.print((arguments.dry_run ? "would revert \"" : "reverted \"") + *what + "\"; " +
                arguments.memory + " holds " + format_count(views, "view") +
                (unit == unit_before ? ""
                 : unit == LengthUnit::metres
                     ? ", with positions in metres"
                     : ", with positions in view steps; for metres: panonav scale " +
                           arguments.memory + " --distance VIEW VIEW LENGTH"));
  return ExitCode::done;
}

Run declare_undo(Arguments& arguments) {
  auto values = std::make_shared<UndoArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.flag("--dry-run", values->dry_run,
                 "Print the change that would be reverted, or why it cannot be, but do not change "
                 "the memory");
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.");
  return [values](Session& session) { return undo(*values, session); };
}

}  // namespace

Verb undo_verb() {
  return {"undo",
          VerbGroup::memory,
          "Revert the last forget, prune, rename, scale or update",
          "An update is that of localise --update. Run panonav undo again to revert earlier "
          "changes; panonav history lists all changes. "
          "Views are restored with their thumbnails, links, positions in maps and former names, "
          "and a map and routes with their former unit. "
          "Views that were added after the reverted change stay in the memory. The verb refuses to "
          "revert a change if a view that was added later has the name of a view that would be "
          "restored, or if a map or route that the change concerned was changed since, as by "
          "memorising more views along it; after a scaling, run panonav scale again instead.",
          "  panonav undo office.panonav --dry-run\n"
          "  panonav undo office.panonav",
          declare_undo};
}

}  // namespace panonav::command
