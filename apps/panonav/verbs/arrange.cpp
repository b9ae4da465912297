#include <algorithm>
#include <filesystem>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "panonav/pipeline/graph_file.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "reports/arrange_report.hpp"
#include "reports/lattice_picture.hpp"
#include "reports/map_measures.hpp"
#include "reports/map_picture.hpp"
#include "reports/report_page.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

struct ArrangeArguments {
  std::string memory;
  std::optional<std::string> odometry;
  PictureArguments pictures;  // topics of the recording; images are not read
  MapFileArguments files;
  std::optional<std::string> report;
  bool no_save = false;
  LatticeOptions lattice;
  CoarseMotionOptions motion;
};

/// Returns the odometry between consecutive images of the data set whose names are in the memory.
std::vector<CoarseMotion> read_motions(const ArrangeArguments& arguments,
                                       const PictureSource& source, const VisualMemory& memory,
                                       Session& session) {
  if (!arguments.odometry) return {};
  const Dataset recording =
      read_dataset_with_columns(*arguments.odometry, arguments.pictures, source,
                                "odom_x_m,odom_y_m,odom_heading_deg", "1.5,0.25,90", session);
  auto motions = make_coarse_motions(recording, memory, arguments.motion);
  if (motions.empty()) {
    throw FileError(*arguments.odometry,
                    "has no odometry between images whose names are in the memory");
  }
  return motions;
}

ordered_json to_json(const MapComparison& comparison) {
  ordered_json json{{"views", comparison.compared},
                    {"procrustes_disparity", comparison.shape.value},
                    {"procrustes_disparity_with_reflection", comparison.shape.with_reflection},
                    {"rms_m", comparison.truth_from_map.rms_m},
                    {"scale", comparison.truth_from_map.scale}};
  json.update(neighbours_json(comparison));
  return json;
}

ordered_json to_json(const ArrangeArguments& arguments, const Lattice& lattice,
                     const VisualMemory& memory) {
  auto components = ordered_json::array();
  for (const Lattice::Component& component : lattice.components) {
    components.push_back(
        {{"views", component.views}, {"handedness_known", component.handedness_known}});
  }
  auto nodes = ordered_json::array();
  for (const Lattice::Node& node : lattice.nodes) {
    nodes.push_back({{"view", node.view.value},
                     {"file", memory.info(node.view).name},
                     {"connected_component", node.component},
                     {"x", node.pose.x_m},
                     {"y", node.pose.y_m},
                     {"heading_rad", arguments.lattice.phases || lattice.metric
                                         ? ordered_json(node.pose.heading_rad)
                                         : ordered_json()}});
  }
  auto joins = ordered_json::array();
  for (const Lattice::Join& join : lattice.joins) {
    joins.push_back({{"views", join.views}, {"pairs", join.pairs}});
  }
  ordered_json json{{"memory", arguments.memory},
                    {"views", lattice.nodes.size()},
                    {"connected_components", std::move(components)},
                    {"joined_pieces", std::move(joins)},
                    {"crossings", lattice.crossings.size()},
                    {"candidates", lattice.candidates},
                    {"springs", lattice.springs.size()},
                    {"springs_rejected", count_rejected_springs(lattice)},
                    {"metric", lattice.metric},
                    {"iterations", lattice.iterations},
                    {"energy", lattice.energy},
                    {"nodes", std::move(nodes)},
                    {"ground_truth", nullptr}};
  if (const auto comparison = compare_with_ground_truth(lattice, memory)) {
    json["ground_truth"] = to_json(*comparison);
  }
  return json;
}

/// Prints what the lattice is for and, if the views have no positions, what makes some.
void print_use(const ArrangeArguments& arguments, const MemoryFile& file, Session& session) {
  if (!arguments.no_save) {
    session.print("The arrangement is stored for panonav navigate (--edges lattice).");
  }
  if (file.info().views_with_position > 0) return;
  session.print(
      "The views still have no positions, which localise and track use. panonav memorise makes a "
      "map with positions if images are 20 to 50 cm apart; take images between those of " +
      arguments.memory + " and add them:");
  session.suggest({"panonav", "memorise", arguments.memory, "INPUT"});
}

void print_result(const Lattice& lattice, const VisualMemory& memory, Session& session) {
  session.print(session.bold(format_count(lattice.nodes.size(), "view")) + " arranged by " +
                format_count(lattice.springs.size(), "pair") + " of similar views (of " +
                std::to_string(lattice.candidates) + " compared); " +
                std::to_string(count_rejected_springs(lattice)) +
                " pairs contradict the others; unit: " +
                (lattice.metric ? "metres" : "median distance to the nearest view"));
  for (const Lattice::Join& join : lattice.joins) {
    session.print("A piece of " + format_count(join.views, "view") + " was joined by " +
                  std::to_string(join.pairs) +
                  " pairs of views that agree on its pose; it may be bent where they meet.");
  }
  if (lattice.components.size() > 1) {
    std::string others;
    std::size_t single_views = 0;
    for (const auto& component : std::span(lattice.components).subspan(1)) {
      single_views += component.views == 1 ? 1 : 0;
      if (component.views == 1) continue;
      others += (others.empty() ? "; the others hold " : ", ") + std::to_string(component.views);
    }
    if (single_views > 0)
      others +=
          "; " + format_count(single_views, "view") + " without a connection to any other view";
    session.print(
        "The largest of " +
        session.red(std::to_string(lattice.components.size()) + " parts that are not connected") +
        " holds " + std::to_string(lattice.components.front().views) + " of the " +
        format_count(lattice.nodes.size(), "view") + others +
        ". Their positions relative to each other are unknown" +
        (lattice.crossings.empty()
             ? std::string(", and no path leads from one to another.")
             : "; navigate can cross between some by homing, along " +
                   format_count(lattice.crossings.size(), "pair") + " of views."));
  }
  if (!lattice.components.front().handedness_known) {
    session.print("The result may be mirrored: left and right cannot be distinguished.");
  }
  if (const auto comparison = compare_with_ground_truth(lattice, memory)) {
    session.print("compared with the ground truth: Procrustes disparity (shape difference) " +
                  session.bold(format_fixed(comparison->shape.value, 4)) + " over " +
                  format_count(comparison->compared, "view") + ", " +
                  format_fixed(comparison->truth_from_map.rms_m, 2) +
                  " m rms with a free scale of " +
                  format_fixed(comparison->truth_from_map.scale, 3));
    print_neighbours(*comparison, session);
  }
}

/// Loads the memory without poses that come from its map: they are no ground truth.
VisualMemory load_with_true_poses(const MemoryFile& file) {
  VisualMemory memory = file.load();
  if (!has_positions_from_map(file)) return memory;
  for (const ViewId view : memory.views()) memory.set_pose(view, std::nullopt);
  return memory;
}

void write_poses(const std::string& file, const Lattice& lattice, const VisualMemory& memory) {
  using Times = TrajectoryUnits::Times;
  write_trajectory(file, make_trajectory(lattice, memory),
                   {.times = has_stamps(lattice, memory) ? Times::stamps : Times::none,
                    .is_metric = lattice.metric});
}

ExitCode arrange_views(const ArrangeArguments& arguments, Session& session) {
  auto file = MemoryFile::open(arguments.memory,
                               arguments.no_save ? Access::read_only : Access::read_write);
  const VisualMemory memory = load_with_true_poses(file);
  if (memory.empty()) {
    return session.no_answer("panonav arrange: " + arguments.memory + " contains no views");
  }
  session.detail(format_count(memory.size(), "view") + " loaded");
  if (arguments.report) prepare_report_folder(*arguments.report, "arrange");
  LatticeSteps steps;
  const LatticeStepCallback step_callback =
      arguments.report ? steps.step_callback() : LatticeStepCallback();
  const Lattice lattice = arrange(memory, arguments.lattice,
                                  read_motions(arguments, file.header().source, memory, session),
                                  session.executor(), step_callback);
  session.detail("views arranged");
  if (!arguments.no_save) store_lattice(lattice, memory, file);
  if (arguments.files.tum) write_poses(*arguments.files.tum, lattice, memory);
  if (arguments.files.graph) {
    write_graph(*arguments.files.graph, to_topological_map(lattice),
                [&](ViewId view) { return memory.info(view).name; });
  }
  if (arguments.files.picture) write_lattice_picture(*arguments.files.picture, lattice, memory);
  if (arguments.report) {
    write_arrange_report(*arguments.report, memory_name(file.path()), lattice, memory, steps);
  }
  if (session.json()) {
    session.print(json_line(to_json(arguments, lattice, memory)));
  } else {
    print_result(lattice, memory, session);
    print_use(arguments, file, session);
    if (arguments.files.picture && lattice.components.size() > 1) {
      session.print(*arguments.files.picture + " shows the largest part of the map, " +
                    std::to_string(lattice.components.front().views) + " of " +
                    format_count(lattice.nodes.size(), "view") + ".");
    }
    if (arguments.report) print_report_path(*arguments.report, session);
  }
  return ExitCode::done;
}

Run declare_arrange(Arguments& arguments) {
  auto values = std::make_shared<ArrangeArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.option("--odometry DATASET", values->odometry,
                   "Read the robot's motion between views from this data set or recording; each "
                   "image is assigned to the view of the same name");
  declare_topics(arguments, values->pictures.topics);
  declare_map_files(arguments, values->files);
  declare_report(arguments, values->report, "a page that shows the arrangement step by step");
  arguments.flag("--no-save", values->no_save, "Do not change the memory file");
  arguments.options("lattice", values->lattice);
  arguments.options("coarse_motion", values->motion, "motion");
  arguments.show_in_help({"--neighbours"});
  arguments.reject_options_unless(
      {"[coarse_motion]"}, [values] { return values->odometry.has_value(); }, "without --odometry");
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.",
      [values] { return !values->no_save; });
  return [values](Session& session) { return arrange_views(*values, session); };
}

}  // namespace

Verb arrange_verb() {
  return {"arrange",
          VerbGroup::maps_and_routes,
          "Compute positions of views from their similarity",
          "The views may be in any order. Poses in the memory are only used to measure the error "
          "of the result. Parts that are not connected have no common frame. The result is stored "
          "in the memory as a map with the name 'lattice', which "
          "navigate uses; it does not change the positions of views (memorise makes them).",
          "  panonav arrange office.panonav --report arranged\n"
          "  panonav arrange hall.panonav --odometry run --graphml hall.graphml --json",
          declare_arrange};
}

}  // namespace panonav::command
