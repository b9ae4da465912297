#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav::command {

namespace {

ExitCode verify(const std::string& path, Session& session) {
  set_skipped_row_handler({});  // `verify` lists these rows itself
  const auto memory = MemoryFile::open(path, Access::read_only);
  const auto faults = memory.verify();
  if (session.json()) {
    auto listed = ordered_json::array();
    for (const auto& fault : faults) {
      listed.push_back({{"view", fault.view ? ordered_json(fault.view->value) : ordered_json()},
                        {"what", fault.what}});
    }
    session.print(
        json_line(ordered_json{{"memory", path}, {"intact", faults.empty()}, {"faults", listed}}));
  } else if (faults.empty()) {
    session.print(path + ": " + session.green("intact") + ", " +
                  format_count(memory.info().views, "view"));
  } else {
    for (const auto& fault : faults) {
      session.print((fault.view ? "view " + std::to_string(fault.view->value) + ": " : "") +
                    fault.what);
    }
  }
  if (faults.empty()) return ExitCode::done;
  session.finish_output();
  throw FileError(path, "is damaged: " + std::to_string(faults.size()) +
                            " faults; first fault: " + faults.front().what);
}

Run declare_verify(Arguments& arguments) {
  auto path = std::make_shared<std::string>();
  arguments.positional("MEMORY", *path, "Memory file");
  return [path](Session& session) { return verify(*path, session); };
}

}  // namespace

Verb verify_verb() {
  return {"verify",
          VerbGroup::memory,
          "Check a memory for damage",
          "The exit code is 0 if the file is intact, and 2 if it is damaged.",
          "  panonav verify office.panonav",
          declare_verify};
}

}  // namespace panonav::command
