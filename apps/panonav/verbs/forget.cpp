#include <algorithm>
#include <set>

#include "cli/verbs.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"

namespace panonav::command {

namespace {

struct ForgetArguments {
  std::string memory;
  std::vector<std::string> views;
  bool dry_run = false;
};

ExitCode forget(const ForgetArguments& wanted, Session& session) {
  auto memory =
      MemoryFile::open(wanted.memory, wanted.dry_run ? Access::read_only : Access::read_write);
  const auto find_all = [&] {
    std::set<ViewId> views;
    for (const auto& name : wanted.views) {
      const auto view = memory.find(name);
      if (!view) {
        throw FileError(wanted.memory, "holds no view " + name + "; nothing was forgotten");
      }
      views.insert(*view);
    }
    return std::vector<ViewId>(views.begin(), views.end());
  };
  const std::vector<ViewId> views = find_all();
  if (!wanted.dry_run) {
    memory.change(
        [&] {
          forget_recordings(memory);
          memory.remove(find_all());
          keep_models(memory);
        },
        "forget: " + std::to_string(views.size()) + " views dropped");
  }
  const auto left = memory.info().views - (wanted.dry_run ? views.size() : 0);
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", wanted.memory},
                                         {"dry_run", wanted.dry_run},
                                         {"forgotten", views.size()},
                                         {"views", left}}));
    return ExitCode::done;
  }
  if (wanted.dry_run) {
    std::size_t links = 0;
    for (const Link& link : memory.links()) {
      links +=
          std::ranges::binary_search(views, link.a) || std::ranges::binary_search(views, link.b)
              ? 1
              : 0;
    }
    session.print("would forget " + std::to_string(views.size()) + " views and " +
                  std::to_string(links) + " links to them; " + wanted.memory + " would hold " +
                  std::to_string(left));
    return ExitCode::done;
  }
  session.print(std::to_string(views.size()) + " views forgotten; " + wanted.memory + " holds " +
                std::to_string(left));
  session.suggest({"panonav", "undo", wanted.memory}, "To bring them back:");
  return ExitCode::done;
}

Run declare_forget(Arguments& arguments) {
  auto wanted = std::make_shared<ForgetArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positionals("VIEW", wanted->views, "Names of views, as localise shows them");
  arguments.flag("--dry-run", wanted->dry_run, "Say what would be forgotten, and forget nothing");
  return [wanted](Session& session) { return forget(*wanted, session); };
}

}  // namespace

Verb forget_verb() {
  return {"forget", "Drop views from a memory",
          "All the named views are dropped or, when one of them is not there, none. panonav undo "
          "brings them back.",
          "  panonav forget office.panonav view_0012.png view_0013.png\n"
          "  panonav forget office.panonav view_0012.png --dry-run",
          declare_forget};
}

}  // namespace panonav::command
