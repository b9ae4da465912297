#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

struct CopyArguments {
  std::string memory;
  std::string copy;
};

ExitCode copy(const CopyArguments& arguments, Session& session) {
  const MemoryFile memory = MemoryFile::open(arguments.memory, Access::read_only);
  memory.copy_to(arguments.copy);
  const MemoryFile::Info info = MemoryFile::open(arguments.copy, Access::read_only).info();
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"copy", arguments.copy},
                                         {"views", info.views},
                                         {"links", info.links},
                                         {"maps", info.maps},
                                         {"routes", info.routes}}));
    return ExitCode::done;
  }
  session.print(arguments.copy + " holds the " + format_count(info.views, "view") + " of " +
                arguments.memory);
  session.suggest({"panonav", "localise", arguments.copy, "INPUT"});
  return ExitCode::done;
}

Run declare_copy(Arguments& arguments) {
  auto values = std::make_shared<CopyArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file, or address of a memory on a server");
  arguments.positional("COPY", values->copy, "Name of the copy: a new file, or an address");
  arguments.declare_outputs({"COPY"});
  return [values](Session& session) { return copy(*values, session); };
}

}  // namespace

Verb copy_verb() {
  return {"copy",
          VerbGroup::memory,
          "Copy a memory to a file, to a server or from a server",
          "The copy contains the same views, images, features, links, maps, routes and models, "
          "with the same ids, and it gives the same results. If copying is interrupted, no copy is "
          "left. The address of a memory on a PostgreSQL server is "
          "postgresql://HOST/DATABASE?memory=NAME (docs/scale.md).",
          "  panonav copy office.panonav office_copy.panonav\n"
          "  panonav copy office.panonav 'postgresql://robots.example/panonav?memory=office'",
          declare_copy};
}

}  // namespace panonav::command
