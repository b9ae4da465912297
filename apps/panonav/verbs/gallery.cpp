#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_viewer/page.hpp"
#include "reports/report_page.hpp"
#include "runs/view_selection.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* page_name = "gallery.html";
/// Maximum number of views on the page, as larger pages open slowly; --name and --near select other
/// views.
constexpr std::size_t max_views = 2000;

struct GalleryArguments {
  std::string memory;
  std::string out;
  ViewSelection selection;
};

/// Titles, each with the views that are shown under it.
using Groups = std::vector<std::pair<std::string, std::vector<ViewRecord>>>;

std::string format_interval(double index, double side_m, LengthUnit unit) {
  return format_number(index * side_m) + " to " + format_number((index + 1.0) * side_m) + " " +
         to_string(unit);
}

/// Groups views by squares of the ground plane, in the order of their first views. The squares are
/// large enough for eight or more views on average.
Groups group_by_squares(const std::vector<ViewRecord>& views, const std::string& prefix,
                        LengthUnit unit) {
  std::map<std::pair<double, double>, std::vector<ViewRecord>> squares;
  double side_m = 0.0;
  for (const double candidate_m :
       {0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0, 1e6, 1e300}) {
    squares.clear();
    side_m = candidate_m;
    for (const ViewRecord& view : views) {
      const auto& pose = *view.info.pose;
      squares[{-std::floor(pose.y_m / side_m), std::floor(pose.x_m / side_m)}].push_back(view);
    }
    if (views.size() >= 8 * squares.size() || squares.size() == 1) break;
  }
  Groups groups;
  for (auto& [square, members] : squares) {
    groups.emplace_back(prefix + "x " + format_interval(square.second, side_m, unit) + ", y " +
                            format_interval(-square.first, side_m, unit),
                        std::move(members));
  }
  std::ranges::sort(groups, {}, [](const auto& group) { return group.second.front().view; });
  return groups;
}

/// Groups views by the folder in their names, then by the part of the map, then by position. Views
/// outside the map come last.
Groups group_views(const std::vector<ViewRecord>& views, LengthUnit unit) {
  constexpr std::size_t no_part = std::numeric_limits<std::size_t>::max();
  std::map<std::pair<std::string, std::size_t>,
           std::pair<std::vector<ViewRecord>, std::vector<ViewRecord>>>
      areas;
  const bool has_parts = std::ranges::any_of(views, [](const auto& v) { return v.component > 0U; });
  for (const ViewRecord& view : views) {
    const std::size_t slash = view.info.name.rfind('/');
    const std::string folder =
        slash == std::string::npos ? "" : view.info.name.substr(0, slash) + ": ";
    const std::size_t part = has_parts && view.component ? *view.component + 1 : no_part;
    auto& [placed, others] = areas[{folder, part}];
    (view.info.pose ? placed : others).push_back(view);
  }
  Groups groups;
  for (auto& [place, members] : areas) {
    const auto& [folder, part] = place;
    auto& [placed, others] = members;
    const std::string title =
        part == no_part ? folder : folder + "part " + std::to_string(part) + " of the map: ";
    if (!placed.empty())
      std::ranges::move(group_by_squares(placed, title, unit), std::back_inserter(groups));
    if (!others.empty())
      groups.emplace_back((title.empty() ? "Position" : title + "position") + " not known",
                          std::move(others));
  }
  return groups;
}

/// Returns the thumbnail as a data URL; empty if there is none. Decodes and encodes it again, so
/// that only pixels of the memory file reach a browser.
std::string thumbnail_url(const MemoryFile& memory, const ViewRecord& view) {
  const auto bytes = view.thumbnail ? memory.thumbnail(view.view) : std::nullopt;
  if (!bytes) return "";
  try {
    const Image picture = decode_image(*bytes, "thumbnail", {.side_px = 4096});
    return viewer::make_data_url("image/png", encode_png(picture.view()));
  } catch (const FileError&) {
    return "";
  }
}

std::string make_caption(const ViewRecord& view, bool pictured, LengthUnit unit) {
  std::string text = std::to_string(view.view.value) + ": " + view.info.name;
  if (const auto& pose = view.info.pose) {
    text += ", x " + format_fixed(pose->x_m, 2) + " y " + format_fixed(pose->y_m, 2) + " " +
            to_string(unit);
    if (pose->heading_rad) text += ", " + format_fixed(degrees(*pose->heading_rad), 0) + "\u00b0";
  }
  return pictured ? text : text + "; no thumbnail";
}

/// Makes the page of the shown `views`, of `found` views that the user selected.
viewer::ReportPage make_gallery_page(const GalleryArguments& arguments, const MemoryFile& memory,
                                     const std::vector<ViewRecord>& views, std::size_t found,
                                     Session& session) {
  const auto pictured = std::ranges::count_if(views, &ViewRecord::thumbnail);
  viewer::ReportPage page(
      "Views of " + memory_name(arguments.memory),
      "This page shows the stored image (thumbnail) of each view of the memory. The forward "
      "direction is in the middle, and the direction behind the robot is at both edges. Below each "
      "image are the view's id, name, position and heading.");
  const auto placed = std::ranges::count_if(
      views, [](const ViewRecord& view) { return view.info.pose.has_value(); });
  page.add_figures({{std::to_string(views.size()), "views"},
                    {std::to_string(placed), "with a position"},
                    {std::to_string(pictured), "with a thumbnail"}});
  if (views.size() < found) {
    page.add_text("The page shows the first " + std::to_string(views.size()) + " of " +
                  format_count(found, "view") +
                  ". To select other views, use --name and --near of panonav gallery.");
  }
  Progress progress(session, "drawing", views.size());
  for (const auto& [title, members] : group_views(views, session.length_unit())) {
    page.begin_section(title + " (" + format_count(members.size(), "view") + ")");
    std::vector<viewer::ReportPicture> pictures;
    for (const ViewRecord& view : members) {
      std::string picture = thumbnail_url(memory, view);
      std::string caption = make_caption(view, !picture.empty(), session.length_unit());
      pictures.push_back({std::move(picture), std::move(caption)});
      progress.advance();
    }
    page.add_thumbnails(pictures);
  }
  return page;
}

ExitCode gallery(const GalleryArguments& arguments, Session& session) {
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  session.set_length_unit(read_length_unit(memory));
  auto views = select_views(list_views(memory), arguments.selection);
  if (views.empty()) throw FileError(arguments.memory, "contains no such view");
  const std::size_t found = views.size();
  const auto pictured =
      static_cast<std::size_t>(std::ranges::count_if(views, &ViewRecord::thumbnail));
  if (pictured == 0) {
    throw FileError(arguments.memory,
                    "contains no thumbnails of these " + format_count(found, "view") +
                        "; to get them, memorise the recording into a new memory without "
                        "--no-thumbnails");
  }
  prepare_report_folder(arguments.out, "gallery", page_name);
  views.resize(std::min(found, max_views));

  const viewer::ReportPage page = make_gallery_page(arguments, memory, views, found, session);
  page.write(arguments.out, page_name, "panonav gallery");
  const std::string path = (fs::path(arguments.out) / page_name).string();
  if (session.json()) {
    session.print(session.json_line(ordered_json{{"memory", arguments.memory},
                                                 {"page", path},
                                                 {"views", found},
                                                 {"shown", views.size()},
                                                 {"thumbnails", pictured}}));
    return ExitCode::done;
  }
  session.print(session.bold(std::to_string(views.size())) + " of " + format_count(found, "view") +
                ", " + std::to_string(pictured) + " with a thumbnail");
  session.print("Open " + session.bold(path) + " in a browser.");
  return ExitCode::done;
}

Run declare_gallery(Arguments& arguments) {
  auto values = std::make_shared<GalleryArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.required_option("-o,--out FOLDER", values->out,
                            "Folder in which gallery.html is written; it must be new or empty, or "
                            "contain an earlier gallery, which is replaced");
  declare_selection(arguments, values->selection);
  arguments.declare_outputs({"--out"});
  return [values](Session& session) { return gallery(*values, session); };
}

}  // namespace

Verb gallery_verb() {
  return {"gallery",
          VerbGroup::memory,
          "Write a page with the thumbnails of a memory",
          "The page gallery.html needs no other files, no network and no scripts. Views are "
          "grouped by the folder in their names, by the connected part of the map and by "
          "place. The page shows at most 2000 views; use --name and --near to select them.",
          "  panonav gallery office.panonav -o gallery\n"
          "  panonav gallery office.panonav -o corner --near 1,1,0.8",
          declare_gallery};
}

}  // namespace panonav::command
