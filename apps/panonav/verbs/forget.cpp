#include <algorithm>
#include <set>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

struct ForgetArguments {
  std::string memory;
  std::vector<std::string> views;
  bool dry_run = false;
};

ExitCode forget(const ForgetArguments& arguments, Session& session) {
  auto memory = MemoryFile::open(arguments.memory,
                                 arguments.dry_run ? Access::read_only : Access::read_write);
  const auto find_all = [&] {
    std::set<ViewId> views;
    for (const auto& name : arguments.views) {
      views.insert(find_view_by_name_or_id(memory, name));
    }
    return std::vector<ViewId>(views.begin(), views.end());
  };
  const std::vector<ViewId> views = find_all();
  if (!arguments.dry_run) {
    memory.change(
        [&] {
          forget_recordings(memory);
          memory.remove(find_all());
          learn_and_store_models(memory);
        },
        "forget: " + format_count(views.size(), "view") + " deleted");
  }
  const auto left = memory.info().views - (arguments.dry_run ? views.size() : 0);
  if (session.json()) {
    session.print(json_line(ordered_json{{"memory", arguments.memory},
                                         {"dry_run", arguments.dry_run},
                                         {"forgotten", views.size()},
                                         {"views", left}}));
    return ExitCode::done;
  }
  if (arguments.dry_run) {
    std::size_t links = 0;
    for (const Link& link : memory.links()) {
      links +=
          std::ranges::binary_search(views, link.a) || std::ranges::binary_search(views, link.b)
              ? 1
              : 0;
    }
    session.print("would delete " + format_count(views.size(), "view") + " and " +
                  format_count(links, "link") + " to them; " + arguments.memory +
                  " would then contain " + std::to_string(left));
    return ExitCode::done;
  }
  session.print(format_count(views.size(), "view") + " deleted; " + arguments.memory + " holds " +
                std::to_string(left));
  session.suggest({"panonav", "undo", arguments.memory}, "To restore them:");
  return ExitCode::done;
}

Run declare_forget(Arguments& arguments) {
  auto values = std::make_shared<ForgetArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.positionals("VIEW", values->views, "Names or ids of views");
  arguments.flag("--dry-run", values->dry_run,
                 "Print how many views and links would be deleted, but do not change the memory");
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.",
      [values] { return !values->dry_run; });
  return [values](Session& session) { return forget(*values, session); };
}

}  // namespace

Verb forget_verb() {
  return {"forget",
          VerbGroup::memory,
          "Delete views from a memory",
          "If one of the views does not exist, no view is deleted. panonav undo restores deleted "
          "views.",
          "  panonav forget office.panonav view_0012.png view_0013.png\n"
          "  panonav forget office.panonav view_0012.png --dry-run",
          declare_forget};
}

}  // namespace panonav::command
