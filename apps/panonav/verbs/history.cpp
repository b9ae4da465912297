#include <array>
#include <cmath>
#include <ctime>

#include "cli/verbs.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

std::string format_line(const MemoryFile::KeptChange& change) {
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
    for (const MemoryFile::KeptChange& change : changes) {
      list.push_back({{"what", change.what},
                      {"stamp_s", to_json_or_null(change.stamp_s)},
                      {"undoable", change.undoable},
                      {"bytes", change.bytes}});
    }
    session.print(json_line(ordered_json{{"memory", path}, {"changes", std::move(list)}}));
    return ExitCode::done;
  }
  for (const MemoryFile::KeptChange& change : changes) session.print(format_line(change));
  if (changes.empty()) session.note(path + " contains no changes");
  return ExitCode::done;
}

Run declare_history(Arguments& arguments) {
  auto memory = std::make_shared<std::string>();
  arguments.positional("MEMORY", *memory, "Memory file");
  return [memory](Session& session) { return history(*memory, session); };
}

}  // namespace

Verb history_verb() {
  return {"history",
          VerbGroup::memory,
          "List the changes of a memory, newest first",
          "The list contains the newest 1000 changes by forget, prune, rename, scale and "
          "localise --update. panonav undo reverts the newest change; run it again to revert the "
          "change "
          "before. The newest 100 changes (at most 64 MiB in total) can be reverted.",
          "  panonav history office.panonav\n"
          "  panonav history office.panonav --json",
          declare_history};
}

}  // namespace panonav::command
