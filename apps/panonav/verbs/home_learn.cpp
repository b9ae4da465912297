#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/chain_route.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct LearnArguments {
  std::string memory;
  std::string dataset;
  PictureArguments pictures;
  std::string name = "home";
  bool odometry = false;
  std::optional<std::string> report;
  HomeAreaOptions area;
};

double radius_m(const SnapshotChain& area) {
  double radius_m = 0.0;
  for (const ChainNode& node : area.nodes()) {
    radius_m = std::max(radius_m, distance(node.position, {}));
  }
  return radius_m;
}

void print_area(const LearnArguments& arguments, const HomeArea& area, Session& session) {
  const std::size_t bytes = area.chain.pack().size();
  if (session.json()) {
    session.print(
        session.json_line(ordered_json{{"memory", arguments.memory},
                                       {"area", arguments.name},
                                       {"snapshots", area.chain.snapshots()},
                                       {"radius_m", radius_m(area.chain)},
                                       {"bytes", bytes},
                                       {"returns", area.returns},
                                       {"held_out", area.held_out.size()},
                                       {"homeward_component", area.homeward_component()}}));
    return;
  }
  session.print("home '" + arguments.name + "' in " + arguments.memory + ": " +
                session.bold(format_count(area.chain.snapshots(), "snapshot")) + " within " +
                session.format_length(radius_m(area.chain), 1) + " of home, " +
                std::to_string(bytes) + " bytes; homeward component " +
                format_fixed(area.homeward_component(), 2) + " over " +
                format_count(area.held_out.size(), "view") + " that are not stored");
  session.print("The walk was seen to pass home " + format_count(area.returns, "time") +
                (area.returns == 0 ? "; errors of its odometry are not corrected." : "."));
  if (area.chain.snapshots() == 1) {
    session.print("No other view improves the home vectors; walk farther, with home in between.");
  }
  session.suggest({"panonav", "home", arguments.name, "FLIGHT", "--memory", arguments.memory,
                   "--area", "--back-from", "N"});
}

/// Draws the home vectors of the views that are not stored, and the places of the snapshots.
void write_learn_report(const fs::path& folder, const HomeArea& area) {
  viewer::MapLayer arrows{.label = "home vector", .colour = viewer::PlotColour::blue};
  viewer::MapLayer without{.label = "no home vector", .colour = viewer::PlotColour::vermilion};
  constexpr double arrow_m = 0.3;
  for (const HeldOutView& view : area.held_out) {
    if (!view.home_vector) {
      without.crosses.push_back(view.pose.position());
      continue;
    }
    const double towards = std::atan2(view.home_vector->y_m, view.home_vector->x_m);
    arrows.lines.push_back(make_arrow_line({view.pose.x_m, view.pose.y_m, towards}, arrow_m));
  }
  viewer::MapLayer snapshots{.label = "snapshot", .colour = viewer::PlotColour::green};
  for (const ChainNode& node : area.chain.nodes()) {
    if (node.has_snapshot()) snapshots.dots.push_back(node.position);
  }
  const viewer::MapLayer home{
      .label = "home", .colour = viewer::PlotColour::black, .squares = {Point2{}}};
  viewer::ReportPage page("Home area",
                          "panonav learnt the surroundings of a home from a walk around it.");
  page.add_figures(
      {{std::to_string(area.chain.snapshots()), "snapshots"},
       {std::to_string(area.chain.pack().size()), "bytes"},
       {format_fixed(area.homeward_component(), 2), "homeward component; 1: straight home"}});
  page.begin_section("Field of home vectors");
  page.add_plots({{viewer::MapPlot{.title = "Home vectors from above",
                                   .layers = {arrows, without, snapshots, home}},
                   "Views of the walk that are not stored, and where their home vectors point"}});
  page.write(folder, "index.html", "panonav home learn");
}

ExitCode learn(const LearnArguments& arguments, Session& session) {
  std::optional<MemoryFile> memory;
  if (memory_exists(arguments.memory))
    memory = MemoryFile::open(arguments.memory, Access::read_write);
  const Dataset dataset =
      open_recording(arguments.dataset, arguments.pictures,
                     memory ? std::optional(memory->header().source) : std::nullopt, session);
  if (arguments.report) prepare_report_folder(*arguments.report, "home learn");
  const bool is_new = !memory;
  if (is_new) {
    memory = MemoryFile::create(arguments.memory,
                                make_header_from_recording(dataset, {}, {}, session.executor()));
  }
  try {
    const DrivePoses walk =
        find_drive_poses(dataset, *memory, arguments.name, arguments.odometry, session.executor());
    Progress bar(session, "learning", walk.drive.entries.size());
    const HomeArea area = learn_home_area(*memory, arguments.name, walk, arguments.area,
                                          session.executor(), [&] { bar.advance(); });
    bar.clear();
    print_area(arguments, area, session);
    if (arguments.report) {
      write_learn_report(*arguments.report, area);
      print_report_path(*arguments.report, session);
    }
  } catch (...) {
    memory.reset();
    std::error_code ignored;
    if (is_new) fs::remove(arguments.memory, ignored);
    throw;
  }
  return ExitCode::done;
}

Run declare_home_learn(Arguments& arguments) {
  auto values = std::make_shared<LearnArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file (NAME.panonav), new or existing");
  arguments.positional("INPUT", values->dataset,
                       "Data set, folder of images, video or recording of a walk that begins at "
                       "home and passes it now and then, with positions or odometry");
  arguments.option("--name NAME", values->name, "Name of the home");
  arguments.flag("--odometry", values->odometry,
                 "Use the poses of the odometry, even if the data set has positions");
  declare_report(arguments, values->report, "a page with the field of home vectors");
  declare_pictures(arguments, values->pictures);
  arguments.options("home_area", values->area);
  return [values](Session& session) { return learn(*values, session); };
}

}  // namespace

Verb home_learn_verb() {
  return {"home learn",
          VerbGroup::localisation,
          "Learn the surroundings of a home from a walk around it",
          "The walk begins at home and passes it now and then, for example along loops of growing "
          "size; where it is seen to be at home again, errors of its odometry are corrected. The "
          "verb stores the few small snapshots that improve the home vectors of the other views "
          "most. With panonav home --area, a robot finds home again after a long way by odometry.",
          "  panonav home learn office.panonav walk_run\n"
          "  panonav home learn office.panonav walk_run --name dock --odometry --max-bytes 5000 "
          "--report dock",
          declare_home_learn};
}

}  // namespace panonav::command
