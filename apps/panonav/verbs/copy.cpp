#include "cli/verbs.hpp"
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
  session.print(arguments.copy + " holds the " + std::to_string(info.views) + " views of " +
                arguments.memory);
  session.suggest({"panonav", "localise", arguments.copy, "INPUT"});
  return ExitCode::done;
}

Run declare_copy(Arguments& arguments) {
  auto values = std::make_shared<CopyArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file, or address of one on a server");
  arguments.positional("COPY", values->copy, "The copy: a new file, or an address");
  arguments.writes({"COPY"});
  return [values](Session& session) { return copy(*values, session); };
}

}  // namespace

Verb copy_verb() {
  return {"copy", "Copy a memory: to a server, back, or to another file",
          "The copy has the same content with the same ids, so that it gives the same answers: "
          "views, images, features, links, maps, routes and models. It is made completely or not "
          "at all. The address of a memory on a PostgreSQL server is "
          "postgresql://HOST/DATABASE?memory=NAME (docs/scale.md).",
          "  panonav copy office.panonav office_copy.panonav\n"
          "  panonav copy office.panonav 'postgresql://robots.example/panonav?memory=office'",
          declare_copy};
}

}  // namespace panonav::command
