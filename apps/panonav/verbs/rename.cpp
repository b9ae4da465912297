#include "cli/verbs.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

struct RenameArguments {
  std::string memory;
  std::string name;
  std::string new_name;
  bool route = false;
};

ExitCode rename(const RenameArguments& arguments, Session& session) {
  auto memory = MemoryFile::open(arguments.memory, Access::read_write);
  const std::string what = arguments.route ? "route" : "view";
  std::string former = arguments.name;
  const std::string new_name =
      is_utf8(arguments.new_name) ? arguments.new_name : escape_name(arguments.new_name);
  const auto find = [&] {
    const ViewId view = find_view_by_name_or_id(memory, arguments.name);
    former = memory.load({&view, 1}).info(view).name;
    return view;
  };
  if (!arguments.route) (void)find();  // finds the old name for the history
  memory.change(
      [&] {
        if (arguments.route) {
          memory.rename_route(arguments.name, new_name);
        } else {
          // Makes recordings that contain the old name be compared again.
          forget_recordings(memory);
          memory.rename(find(), new_name);
        }
      },
      "rename: " + what + " " + to_readable_line(former) + " to " + to_readable_line(new_name));
  if (session.json()) {
    session.print(json_line(ordered_json{
        {"memory", arguments.memory}, {"what", what}, {"former", former}, {"name", new_name}}));
    return ExitCode::done;
  }
  session.print("the " + what + " " + to_readable_line(former) + " of " + arguments.memory +
                " was renamed to " + session.bold(to_readable_line(new_name)));
  session.suggest({"panonav", "undo", arguments.memory}, "To revert this:");
  return ExitCode::done;
}

Run declare_rename(Arguments& arguments) {
  auto values = std::make_shared<RenameArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.positional("VIEW", values->name, "Name or id of a view; with --route: name of a route");
  arguments.positional("NEW_NAME", values->new_name, "New name, not yet used in the memory");
  arguments.flag("--route", values->route, "Rename a route instead of a view");
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.");
  return [values](Session& session) { return rename(*values, session); };
}

}  // namespace

Verb rename_verb() {
  return {"rename",
          VerbGroup::memory,
          "Rename a view or a route of a memory",
          "The id, links and positions in maps of the view do not change. If you memorise the same "
          "image again under its old name, it is stored as another view. panonav undo restores the "
          "old name.",
          "  panonav rename office.panonav view_00012.png door\n"
          "  panonav rename office.panonav route to_the_lab --route",
          declare_rename};
}

}  // namespace panonav::command
