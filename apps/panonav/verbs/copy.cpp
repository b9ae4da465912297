#include "cli/verbs.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

namespace {

struct CopyArguments {
  std::string memory;
  std::string copy;
};

ExitCode copy(const CopyArguments& wanted, Session& session) {
  const MemoryFile memory = MemoryFile::open(wanted.memory, Access::read_only);
  memory.copy_to(wanted.copy);
  const MemoryFile::Info info = MemoryFile::open(wanted.copy, Access::read_only).info();
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", wanted.memory},
                                         {"copy", wanted.copy},
                                         {"views", info.views},
                                         {"links", info.links},
                                         {"maps", info.maps},
                                         {"routes", info.routes}}));
    return ExitCode::done;
  }
  session.print(wanted.copy + " holds the " + std::to_string(info.views) + " views of " +
                wanted.memory);
  session.suggest({"panonav", "localise", wanted.copy, "INPUT"});
  return ExitCode::done;
}

Run declare_copy(Arguments& arguments) {
  auto wanted = std::make_shared<CopyArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file, or address of one on a server");
  arguments.positional("COPY", wanted->copy, "What is made: a new file, or an address");
  return [wanted](Session& session) { return copy(*wanted, session); };
}

}  // namespace

Verb copy_verb() {
  return {"copy", "Copy a memory: to a server, back, or to another file",
          "The copy holds the same under the same ids, so that it gives the same answers: views, "
          "pictures, features, links, maps, routes and what was learnt. It is made whole or not "
          "at all. The address of a memory on a PostgreSQL server is "
          "postgresql://HOST/DATABASE?memory=NAME (docs/scale.md).",
          "  panonav copy office.panonav office_copy.panonav\n"
          "  panonav copy office.panonav 'postgresql://robots.example/panonav?memory=office'",
          declare_copy};
}

}  // namespace panonav::command
