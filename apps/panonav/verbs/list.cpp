#include <algorithm>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/floors.hpp"
#include "runs/view_selection.hpp"

namespace panonav::command {

namespace {

struct ListArguments {
  std::string memory;
  ViewSelection selection;
  bool csv = false;
};

ordered_json to_json(const ViewRecord& record) {
  const auto& [view, info, links, thumbnail, component] = record;
  return {{"id", view.value},
          {"name", info.name},
          {"floor", floor_of(info.name).empty() ? ordered_json() : floor_of(info.name)},
          {"pose", pose_json(info.pose)},
          {"stamp_s", to_json_or_null(info.stamp_s)},
          {"links", links},
          {"connected_component", to_json_or_null(component)},
          {"thumbnail", thumbnail}};
}

/// A column with its title and a function that returns its text for a view, empty if there is no
/// value.
struct Column {
  std::string title;
  std::string (*cell)(const ViewRecord&);
  bool text = false;  // left-aligned
};

std::size_t display_width(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

/// Returns the lines of the table, the header first. Columns without any value are left out.
std::vector<std::string> format_table(const std::vector<ViewRecord>& views, LengthUnit unit) {
  const std::string brackets = unit == LengthUnit::metres ? " [m]" : " [view steps]";
  const std::vector<Column> columns{
      {"id", [](const ViewRecord& v) { return std::to_string(v.view.value); }},
      {"name",
       [](const ViewRecord& v) { return shorten_middle(to_readable_line(v.info.name), 60); }, true},
      {"x" + brackets,
       [](const ViewRecord& v) { return v.info.pose ? format_fixed(v.info.pose->x_m, 2) : ""; }},
      {"y" + brackets,
       [](const ViewRecord& v) { return v.info.pose ? format_fixed(v.info.pose->y_m, 2) : ""; }},
      {"heading [deg]",
       [](const ViewRecord& v) {
         const auto& pose = v.info.pose;
         return pose && pose->heading_rad ? format_fixed(degrees(*pose->heading_rad), 1) : "";
       }},
      {"stamp [s]",
       [](const ViewRecord& v) { return v.info.stamp_s ? format_fixed(*v.info.stamp_s, 3) : ""; }},
      {"links", [](const ViewRecord& v) { return v.links > 0 ? std::to_string(v.links) : ""; }},
      {"part",
       [](const ViewRecord& v) { return v.component ? std::to_string(*v.component + 1) : ""; }},
      {"thumbnail", [](const ViewRecord& v) -> std::string { return v.thumbnail ? "yes" : ""; }}};
  std::vector<std::string> lines(views.size() + 1);
  for (const Column& column : columns) {
    std::vector<std::string> cells;
    std::size_t width = 0;
    for (const ViewRecord& view : views) {
      width = std::max(width, display_width(cells.emplace_back(column.cell(view))));
    }
    if (width == 0) continue;
    cells.insert(cells.begin(), column.title);
    width = std::max(width, column.title.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string blanks(width - display_width(cells[i]), ' ');
      lines[i] +=
          (lines[i].empty() ? "" : "  ") + (column.text ? cells[i] + blanks : blanks + cells[i]);
    }
  }
  for (std::string& line : lines) line.erase(line.find_last_not_of(' ') + 1);
  return lines;
}

std::string list_names(const std::string& what, const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + to_readable_line(name);
  return names.empty() ? "" : "; " + what + ": " + text;
}

ExitCode list(const ListArguments& arguments, Session& session) {
  if (arguments.csv && session.json()) throw UsageError("--csv and --json cannot be combined");
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  session.set_length_unit(read_length_unit(memory));
  const auto all = list_views(memory);
  const auto views = select_views(all, arguments.selection);
  const ExitCode code = views.empty() ? ExitCode::no_answer : ExitCode::done;
  if (arguments.csv) {
    std::string table = format_view_table(views, session.length_unit());
    table.pop_back();
    session.print(table);
    return code;
  }
  const auto routes = memory.route_names();
  const auto maps = memory.map_names();
  if (session.json()) {
    auto list = ordered_json::array();
    for (const ViewRecord& view : views) list.push_back(to_json(view));
    session.print(session.json_line(ordered_json{{"memory", arguments.memory},
                                                 {"views", std::move(list)},
                                                 {"routes", routes},
                                                 {"maps", maps}}));
    return code;
  }
  if (!views.empty()) {
    const auto lines = format_table(views, session.length_unit());
    session.print(session.bold(lines.front()));
    for (std::size_t i = 1; i < lines.size(); ++i) session.print(lines[i]);
  }
  session.print(std::to_string(views.size()) +
                (views.size() < all.size() ? " of " + std::to_string(all.size()) : "") + " views" +
                list_names("routes", routes) + list_names("maps", maps));
  return code;
}

Run declare_list(Arguments& arguments) {
  auto values = std::make_shared<ListArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  declare_selection(arguments, values->selection);
  arguments.flag("--csv", values->csv, "Print the list as CSV");
  return [values](Session& session) { return list(*values, session); };
}

}  // namespace

Verb list_verb() {
  return {"list",
          VerbGroup::memory,
          "List the views, routes and maps of a memory",
          "Each line describes one view: id, name, position, heading, time stamp, number of links "
          "to other views, part of the map that contains it (views of one part are connected), and "
          "whether it has a "
          "thumbnail. The exit code is 1 if no view is listed.",
          "  panonav list office.panonav\n"
          "  panonav list office.panonav --near 1,1,0.5\n"
          "  panonav list office.panonav --name 'view_0001*' --csv",
          declare_list};
}

}  // namespace panonav::command
