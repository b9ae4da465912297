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

ExitCode rename(const RenameArguments& wanted, Session& session) {
  auto memory = MemoryFile::open(wanted.memory, Access::read_write);
  const std::string what = wanted.route ? "route" : "view";
  std::string former = wanted.name;
  const auto find = [&] {
    const ViewId view = find_view_by_name_or_id(memory, wanted.name);
    former = memory.load({&view, 1}).info(view).name;
    return view;
  };
  if (!wanted.route) (void)find();  // its name stands in what can be undone
  memory.change(
      [&] {
        if (wanted.route) {
          memory.rename_route(wanted.name, wanted.new_name);
        } else {
          // A recording that knows the view by its former name is compared anew.
          forget_recordings(memory);
          memory.rename(find(), wanted.new_name);
        }
      },
      "rename: " + what + " " + to_readable_line(former) + " to " +
          to_readable_line(wanted.new_name));
  if (session.json()) {
    session.print(json_line(ordered_json{
        {"memory", wanted.memory}, {"what", what}, {"former", former}, {"name", wanted.new_name}}));
    return ExitCode::done;
  }
  session.print("the " + what + " " + to_readable_line(former) + " of " + wanted.memory +
                " is now called " + session.strong(to_readable_line(wanted.new_name)));
  session.suggest({"panonav", "undo", wanted.memory}, "To take it back:");
  return ExitCode::done;
}

Run declare_rename(Arguments& arguments) {
  auto wanted = std::make_shared<RenameArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positional("VIEW", wanted->name, "Name or id of a view; with --route that of a route");
  arguments.positional("NEW_NAME", wanted->new_name, "A name that the memory does not hold yet");
  arguments.flag("--route", wanted->route, "VIEW is the name of a route");
  return [wanted](Session& session) { return rename(*wanted, session); };
}

}  // namespace

Verb rename_verb() {
  return {"rename", "Give a view or a route of a memory another name",
          "Its id, links and place in maps stay. A recording that holds the picture under the "
          "former name would be memorised as another view. panonav undo takes it back.",
          "  panonav rename office.panonav view_00012.png door\n"
          "  panonav rename office.panonav route to_the_lab --route",
          declare_rename};
}

}  // namespace panonav::command
