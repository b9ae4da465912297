#include <array>
#include <cmath>
#include <ctime>
#include <memory>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
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
        "has nothing to undo; allowed: after forget, prune, rename, and --learn of localise and "
        "run");
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

std::string as_text(const KeptChange& change) {
  std::string when = "at an unknown time";
  if (change.stamp_s) {
    const auto whole_s = static_cast<std::time_t>(std::floor(*change.stamp_s));
    std::tm utc{};
    gmtime_r(&whole_s, &utc);
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &utc);
    when = text.data();
  }
  return when + "  " + to_readable_line(change.what) +
         (change.undoable ? "" : "  (too old to undo)");
}

ExitCode history(const std::string& path, Session& session) {
  const auto changes = MemoryFile::open(path, Access::read_only).history();
  if (session.json()) {
    auto list = ordered_json::array();
    for (const KeptChange& change : changes) {
      list.push_back({{"what", change.what},
                      {"stamp_s", or_null(change.stamp_s)},
                      {"undoable", change.undoable},
                      {"bytes", change.bytes}});
    }
    session.print(json_line(ordered_json{{"memory", path}, {"changes", std::move(list)}}));
    return ExitCode::done;
  }
  for (const KeptChange& change : changes) session.print(as_text(change));
  if (changes.empty()) session.note(path + " keeps no change");
  return ExitCode::done;
}

Run declare_history(Arguments& arguments) {
  auto memory = std::make_shared<std::string>();
  arguments.positional("MEMORY", *memory, "Memory file");
  return [memory](Session& session) { return history(*memory, session); };
}

}  // namespace

Verb history_verb() {
  return {"history", "List the changes that a memory keeps, the newest first",
          "Each forget, prune and rename, and each --learn of localise and run that changed "
          "something. panonav undo takes back the newest, then the one before it. Of changes "
          "beyond the newest 100, or 64 MiB, the line alone is left, of 1000 at most.",
          "  panonav history office.panonav\n"
          "  panonav history office.panonav --json",
          declare_history};
}

Verb undo_verb() {
  return {"undo", "Take back the last forget, prune, rename or --learn",
          "Again, it takes back the change before (panonav history lists them). Views come back "
          "with their small pictures, their links, what they were in maps, and "
          "their former names. Views that were added since stay. The verb is refused when one of "
          "them has the name of a view that comes back, or when a map was made anew.",
          "  panonav undo office.panonav --dry-run\n"
          "  panonav undo office.panonav",
          declare_undo};
}

}  // namespace panonav::command
