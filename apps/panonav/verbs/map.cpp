#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/pipeline/graph_file.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/storage/memory_address.hpp"
#include "reports/map_picture.hpp"
#include "reports/report_page.hpp"
#include "runs/memorising.hpp"
#include "runs/recording.hpp"
#include "runs/run_record.hpp"
#include "runs/shown_map.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct MapArguments {
  std::string dataset;
  std::string memory;
  std::optional<std::string> tum;
  std::optional<std::string> graph;
  std::optional<std::string> picture;
  std::optional<std::string> report;
  RunRecordArguments record;
  PictureArguments pictures;
  SignatureOptions signature;
  MapperOptions mapper;
  bool no_thumbnails = false;
};

/// Poses of the largest component over time. The stamp is the number of the picture where the
/// recording has none.
std::vector<StampedPose> trajectory_of(const Dataset& recording, const Mapper::Result& run,
                                       const std::string& dataset) {
  std::vector<StampedPose> trajectory;
  const std::size_t component = find_largest_component(run.map);
  for (std::size_t i = 0; i < run.map.nodes.size(); ++i) {
    if (run.map.nodes[i].component != component) continue;
    const DatasetEntry& entry = recording.entries[run.observations[i]];
    const double stamp_s = entry.stamp_s.value_or(static_cast<double>(run.observations[i]));
    if (!trajectory.empty() && !(stamp_s > trajectory.back().stamp_s)) {
      throw FileError(dataset, "stamp_s of " + entry.file + " is " + to_text(stamp_s) +
                                   "; allowed for --tum: > " + to_text(trajectory.back().stamp_s) +
                                   ", the stamp before it");
    }
    trajectory.push_back({stamp_s, run.map.nodes[i].pose});
  }
  return trajectory;
}

std::vector<std::size_t> component_sizes(const TopologicalMap& map) {
  std::vector<std::size_t> sizes(count_components(map), 0);
  for (const MapNode& node : map.nodes) ++sizes[node.component];
  return sizes;
}

std::size_t number_of_closures(const TopologicalMap& map) {
  return static_cast<std::size_t>(std::ranges::count(map.edges, LinkKind::closure, &MapEdge::kind));
}

ordered_json as_json(const MapComparison& comparison) {
  ordered_json json{{"nodes", comparison.compared},
                    {"procrustes_disparity", comparison.shape_difference},
                    {"rms_m", comparison.rms_m},
                    {"scale", comparison.scale},
                    {"trustworthiness", or_null(comparison.trustworthiness)},
                    {"continuity", or_null(comparison.continuity)},
                    {"right_closures", comparison.right_closures},
                    {"wrong_closures", comparison.wrong_closures},
                    {"odometry_procrustes_disparity", nullptr}};
  if (comparison.odometry_shape_difference) {
    json["odometry_procrustes_disparity"] = *comparison.odometry_shape_difference;
  }
  return json;
}

void print_comparison(const MapComparison& comparison, const Mapper::Result& run,
                      Session& session) {
  session.print("beside the ground truth: Procrustes disparity (shape difference) " +
                session.strong(format_fixed(comparison.shape_difference, 4)) + ", " +
                format_fixed(comparison.rms_m, 2) + " m rms" +
                (run.wheels ? "" : " with a free scale of " + format_fixed(comparison.scale, 2)));
  if (comparison.odometry_shape_difference) {
    session.print("the wheels alone: Procrustes disparity " +
                  format_fixed(*comparison.odometry_shape_difference, 4));
  }
  if (comparison.trustworthiness) {
    session.print("neighbours kept: trustworthiness " +
                  format_fixed(*comparison.trustworthiness, 3) + ", continuity " +
                  format_fixed(*comparison.continuity, 3));
  }
  session.print("closures: right " + std::to_string(comparison.right_closures) + ", wrong " +
                std::to_string(comparison.wrong_closures));
}

void print_result(const MapArguments& wanted, const Dataset& recording, const Mapper::Result& run,
                  Session& session) {
  const std::size_t nodes = run.map.nodes.size();
  const double step_ms =
      1e3 * run.mapping_s / static_cast<double>(std::max<std::size_t>(1, recording.entries.size()));
  const auto sizes = component_sizes(run.map);
  const auto comparison = compare_with_ground_truth(recording, run);
  if (session.json()) {
    ordered_json json{{"memory", wanted.memory},
                      {"pictures", recording.entries.size()},
                      {"nodes", nodes},
                      {"skipped", run.skipped},
                      {"connected_components", sizes},
                      {"closures", number_of_closures(run.map)},
                      {"scale_m", run.scale_m},
                      {"wheels", run.wheels},
                      {"step_ms", step_ms},
                      {"ground_truth", nullptr}};
    if (comparison) json["ground_truth"] = as_json(*comparison);
    session.print(json_line(json));
    return;
  }
  session.print(session.strong(std::to_string(nodes)) + " places from " +
                std::to_string(recording.entries.size()) + " pictures, " +
                std::to_string(number_of_closures(run.map)) + " closures; " +
                format_fixed(step_ms, 2) + " ms a picture");
  if (sizes.size() > 1) {
    std::string text;
    for (const std::size_t size : sizes) text += (text.empty() ? "" : ", ") + std::to_string(size);
    session.print(
        session.bad("The map has " + std::to_string(sizes.size()) + " connected components") +
        ", with these numbers of places: " + text + ".");
    session.print(
        "Pictures taken closer together, odometry in the recording, or another drive through the "
        "same places connect them.");
  }
  const double height_m = wanted.mapper.odometry.camera_height_m;
  if (!run.wheels && height_m > 0.0) {
    session.print("Lengths are read from the ground, " + format_number(height_m) +
                  " m below the camera.");
  } else if (!run.wheels) {
    session.print("Lengths are read from the views: one unit counts as " +
                  format_number(run.scale_m) + " m (--scale-m, --camera-height-m).");
  }
  if (comparison) print_comparison(*comparison, run, session);
  if (wanted.picture) {
    session.print(*wanted.picture + " shows " +
                  (sizes.size() > 1 ? "the largest connected component of the map, " +
                                          std::to_string(std::ranges::max(sizes)) + " of " +
                                          std::to_string(nodes) + " places"
                                    : "the map"));
  }
  session.print(wanted.memory + " holds the map and the views of its places.");
  if (wanted.tum) {
    session.print(*wanted.tum + " holds the poses" +
                  (sizes.size() > 1 ? " of the largest connected component." : "."));
  }
  if (wanted.graph) session.print(*wanted.graph + " holds the map as a graph.");
}

Mapper::Result map_recording(const Dataset& recording, Mapper& mapper, Session& session) {
  Progress progress(session, "mapping", recording.entries.size());
  return mapper.map(recording, session.executor(), [&] { progress.advance(); });
}

/// As `map_recording`, and viewers see how it grows.
Mapper::Result map_in_view(const MapArguments& wanted, const Dataset& recording, Mapper& mapper,
                           Session& session) {
  RunRecord record({.file = std::nullopt, .view = wanted.record.view},
                   std::array{wanted.dataset, wanted.memory}, false, session,
                   {.memory = wanted.memory});
  struct Seen {
    Mapper::EncodedView view;
    recordings::RunMoment moment;
    std::string name;
  };
  GrowingMap shown;
  std::optional<recordings::RunMoment> last;  // waits for what comes of it
  Progress progress(session, "mapping", recording.entries.size());
  make_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        StageClock clock;
        const Observation observation = read_observation(recording.entries[i]);
        clock.stage("reading");
        Seen seen{mapper.encode(observation), recordings::make_moment(observation, i),
                  observation.name};
        clock.stage("unwarping, signature");
        seen.moment.panorama = mapper.encoder().panorama(observation);
        clock.stage("for viewers");
        clock.put(seen.moment);
        return seen;
      },
      [&](std::size_t, Seen&& seen) {
        if (last) record.add(std::move(*last));
        StageClock clock;
        const bool is_node = mapper.add(std::move(seen.view));
        clock.stage("mapping");
        clock.put(seen.moment);
        shown.put(seen.moment, mapper.map_so_far(), is_node, seen.name);
        last = std::move(seen.moment);
        progress.advance();
      });
  Mapper::Result run = mapper.finish();
  if (last) {
    shown.finish(*last, run.map);
    record.add(std::move(*last));
  }
  record.close();
  return run;
}

/// Writes the finished map, then each picture with the pose that it got: of the largest connected
/// component, as components have no common frame.
void record_map(const MapArguments& wanted, const Dataset& recording, const Mapper::Result& run,
                const ViewEncoder& encoder, viewer::RunPage& played, Session& session) {
  RunRecord record({.file = wanted.record.file, .view = std::nullopt},
                   std::array{wanted.dataset, wanted.memory}, false, session, {});
  const std::size_t component = find_largest_component(run.map);
  std::map<std::size_t, std::size_t> nodes;  // by observation
  std::vector<std::string> names;
  for (std::size_t i = 0; i < run.map.nodes.size(); ++i) {
    nodes[run.observations[i]] = i;
    names.push_back(recording.entries[run.observations[i]].file);
  }
  Progress progress(session, "recording", recording.entries.size());
  make_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        const Observation seen = read_observation(recording.entries[i]);
        recordings::RunMoment moment = recordings::make_moment(seen, i);
        moment.panorama = encoder.panorama(seen);
        return moment;
      },
      [&](std::size_t i, recordings::RunMoment&& moment) {
        const auto node = nodes.find(i);
        moment.state = node == nodes.end() ? "between places" : "place of the map";
        moment.sure = node != nodes.end();
        if (moment.sure && run.map.nodes[node->second].component == component) {
          moment.pose = run.map.nodes[node->second].pose;
        }
        if (i == 0) put_component(moment, run.map, component, names);
        if (wanted.report) {
          recordings::RunMoment shown = moment;
          shown.truth.reset();  // in another frame than the map's
          played.add(shown);
        }
        record.add(std::move(moment));
        progress.advance();
      });
  record.close();
}

/// Refuses what is typed and does nothing with this recording, and a height of the camera, also of
/// a file, where lengths cannot be read from the ground.
void refuse_without_effect(const Arguments& arguments, const MapArguments& wanted,
                           const Dataset& recording, const MemoryHeader& header) {
  const auto has_odometry = [](const DatasetEntry& entry) { return entry.odometry.has_value(); };
  const bool all = std::ranges::all_of(recording.entries, has_odometry);
  const bool wheels = wanted.mapper.mapping.wheels && all;
  if (arguments.given("visual_odometry", "camera_height_m") && !header.elevations) {
    throw FileError(wanted.dataset,
                    "does not tell the elevations of its pictures' rows, without which the ground "
                    "is not found; allowed with --camera-height-m: panoramas with elevation_deg, "
                    "equirectangular pictures, and mirror pictures with a camera");
  }
  if (arguments.given("visual_odometry", "camera_height_m") && wheels) {
    throw FileError(wanted.dataset,
                    "has odometry, which tells the lengths of all steps; allowed with "
                    "--camera-height-m: recordings without it, or --wheels false");
  }
  if (wheels) {
    arguments.refuse_unused({"--scale-m", "--step-deviation"},
                            "where odometry tells the lengths of all steps");
  }
  if (all) arguments.refuse_unused({"--bridge-m"}, "where odometry tells of all steps");
  if (std::ranges::none_of(recording.entries, has_odometry)) {
    if (wanted.mapper.mapping.wheels) {
      arguments.refuse_unused({"--wheels"}, "as " + wanted.dataset + " has no odometry");
    }
  }
}

ExitCode map(const Arguments& arguments, const MapArguments& wanted, Session& session) {
  if (wanted.report) prepare_report_folder(*wanted.report, "map");
  const bool there = memory_exists(wanted.memory);
  std::optional<MemoryFile> memory;
  if (there) memory = MemoryFile::open(wanted.memory, Access::read_write);
  const Dataset recording =
      memory ? open_recording(wanted.dataset, wanted.pictures, *memory, session)
             : open_recording(wanted.dataset, wanted.pictures, std::nullopt, session);
  if (memory) {
    require_kept_options(arguments, wanted.signature, memory->header().preprocessing, *memory);
    refuse_without_effect(arguments, wanted, recording, memory->header());
  } else {
    const MemoryHeader header =
        make_header_of_recording(recording, wanted.signature, {}, session.executor());
    refuse_without_effect(arguments, wanted, recording, header);
    memory = MemoryFile::create(wanted.memory, header);
  }
  MapperOptions options = wanted.mapper;
  options.thumbnails = !wanted.no_thumbnails;
  Mapper mapper(std::move(*memory), recording.source, options);
  if (there) check_known_views(recording, mapper.memory(), mapper.encoder(), session.executor());
  const Mapper::Result run = wanted.record.view ? map_in_view(wanted, recording, mapper, session)
                                                : map_recording(recording, mapper, session);
  if (wanted.tum) write_trajectory(*wanted.tum, trajectory_of(recording, run, wanted.dataset));
  if (wanted.graph) {
    write_graph(*wanted.graph, run.map, [&](ViewId view) {
      const auto found = std::ranges::lower_bound(run.map.nodes, view, {}, &MapNode::view);
      const auto number = static_cast<std::size_t>(found - run.map.nodes.begin());
      return recording.entries[run.observations[number]].file;
    });
  }
  viewer::RunPage played("", recording.entries.size());
  if (wanted.record.file || wanted.report) {
    record_map(wanted, recording, run, mapper.encoder(), played, session);
  }
  if (wanted.picture) write_map_picture(*wanted.picture, recording, run);
  if (wanted.report) {
    write_map_report(*wanted.report, fs::path(wanted.memory).filename().string(), recording, run,
                     played);
  }
  print_result(wanted, recording, run, session);
  if (wanted.report) tell_report(*wanted.report, session);
  return ExitCode::done;
}

Run declare_map(Arguments& arguments) {
  auto wanted = std::make_shared<MapArguments>();
  arguments.positional(
      "DATASET", wanted->dataset,
      "Data set, folder of pictures, video or recording, in the order in which they were taken");
  arguments.positional("MEMORY", wanted->memory,
                       "Memory file (NAME.panonav); views that it does not know are appended");
  declare_pictures(arguments, wanted->pictures);
  arguments.option(
      "--tum FILE", wanted->tum,
      "Write the poses of the largest component to this file: TUM text, or CSV for a name "
      "that ends in .csv");
  arguments.option("--graphml FILE", wanted->graph, "Write the map as a graph to this file");
  declare_record(arguments, wanted->record);
  declare_view(arguments, wanted->record);
  arguments.uncommon({"--record"});
  arguments.option("--picture FILE", wanted->picture,
                   "Draw the map, beside the truth where it is known, into this PNG or SVG file");
  arguments.option("--report FOLDER", wanted->report,
                   "Write a page that plays the drive on its map into this folder: a new one, or "
                   "that of an earlier report");
  arguments.uncommon({"--picture"});
  arguments.flag("--no-thumbnails", wanted->no_thumbnails,
                 "Do not keep small pictures of the views");
  arguments.options("signature", wanted->signature);
  arguments.options("mapping", wanted->mapper.mapping);
  arguments.options("visual_odometry", wanted->mapper.odometry);
  arguments.options("loop_closure", wanted->mapper.closure, "closure");
  arguments.options("pose_graph", wanted->mapper.graph, "graph");
  arguments.common({"--camera-height-m", "--capture-difference"});
  arguments.used_only(
      {"[loop_closure]", "[pose_graph]"}, [wanted] { return wanted->mapper.mapping.close_loops; },
      "with --close-loops false");
  arguments.used_only(
      {"--distance-components", "--turn-components"},
      [wanted] { return wanted->mapper.odometry.rule == VisualOdometryOptions::Rule::published; },
      "without --rule published");
  arguments.used_only(
      {"--iterations", "--nearer-side"},
      [wanted] { return wanted->mapper.odometry.rule == VisualOdometryOptions::Rule::home_vector; },
      "with --rule published");
  return [wanted, &arguments](Session& session) { return map(arguments, *wanted, session); };
}

}  // namespace

Verb map_verb() {
  return {"map", "Make a map from pictures in the order in which they were taken",
          "Each picture is placed by what its view shows of the step from the one before; places "
          "that are passed again close the loop. Where the data set has odometry, steps are its, "
          "with turns that the views steady. Without it, --camera-height-m makes metres of "
          "lengths. What nothing connects is kept as separate components.",
          "  panonav map office_run office.panonav\n"
          "  panonav map office_run office.panonav --report mapped --graphml map.graphml\n"
          "  panonav map walk walk.panonav --camera-height-m 0.6\n"
          "  panonav map walk walk.panonav --capture-difference 0.1 --json",
          declare_map};
}

}  // namespace panonav::command
