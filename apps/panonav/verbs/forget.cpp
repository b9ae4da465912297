#include <memory>
#include <set>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"

namespace panonav::command {

namespace {

struct ForgetArguments {
  std::string memory;
  std::vector<std::string> views;
};

ExitCode forget(const ForgetArguments& wanted, Session& session) {
  auto memory = MemoryFile::open(wanted.memory, Access::read_write);
  std::set<ViewId> views;
  for (const auto& name : wanted.views) {
    const auto view = memory.find(name);
    if (!view) {
      throw FileError(wanted.memory, "holds no view " + name + "; nothing was forgotten");
    }
    views.insert(*view);
  }
  forget_recordings(memory);
  memory.remove(std::vector<ViewId>(views.begin(), views.end()));
  keep_models(memory);
  const auto left = memory.info().views;
  if (session.json()) {
    session.print(
        ordered_json{{"memory", wanted.memory}, {"forgotten", views.size()}, {"views", left}}
            .dump());
  } else {
    session.print(std::to_string(views.size()) + " views forgotten; " + wanted.memory + " holds " +
                  std::to_string(left));
  }
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<ForgetArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positionals("VIEW", wanted->views, "Names of views, as localise shows them");
  return [wanted](Session& session) { return forget(*wanted, session); };
}

}  // namespace

Verb forget_verb() {
  return {"forget", "Drop views from a memory",
          "All the named views or, when one of them is not there, none.",
          "  panonav forget office.panonav view_0012.png view_0013.png", declare};
}

}  // namespace panonav::command
