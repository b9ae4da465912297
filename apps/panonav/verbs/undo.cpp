#include "cli/verbs.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

struct UndoArguments {
  std::string memory;
  bool dry_run = false;
};

ExitCode undo(const UndoArguments& wanted, Session& session) {
  auto memory =
      MemoryFile::open(wanted.memory, wanted.dry_run ? Access::read_only : Access::read_write);
  const auto what = memory.undoable();
  if (!what) {
    throw FileError(
        wanted.memory,
        "has nothing to undo; allowed: after forget, prune, rename and localise --update");
  }
  if (!wanted.dry_run) memory.undo();
  const auto views = memory.info().views;
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", wanted.memory},
                                         {"dry_run", wanted.dry_run},
                                         {"undone", *what},
                                         {"views", views}}));
    return ExitCode::done;
  }
  session.print((wanted.dry_run ? "would undo \"" : "undone \"") + *what + "\"; " + wanted.memory +
                " holds " + std::to_string(views) + " views");
  return ExitCode::done;
}

Run declare_undo(Arguments& arguments) {
  auto wanted = std::make_shared<UndoArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.flag("--dry-run", wanted->dry_run, "Say what would be undone, and change nothing");
  return [wanted](Session& session) { return undo(*wanted, session); };
}

}  // namespace

Verb undo_verb() {
  return {"undo", "Take back the last forget, prune, rename or --update",
          "Again, it takes back the change before (panonav history lists them). Views come back "
          "with their small pictures, their links, what they were in maps, and "
          "their former names. Views that were added since stay. The verb is refused when one of "
          "them has the name of a view that comes back, or when a map was made anew.",
          "  panonav undo office.panonav --dry-run\n"
          "  panonav undo office.panonav",
          declare_undo};
}

}  // namespace panonav::command
