#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/pipeline/graph_file.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/view_list.hpp"
#include "panonav/storage/memory_address.hpp"
#include "reports/map_measures.hpp"
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
  std::string memory;
  std::string dataset;
  std::vector<std::string> inputs;  // `dataset` and the videos that continue it
  MapFileArguments files;
  std::optional<std::string> report;
  RunRecordArguments record;
  PictureArguments pictures;
  SignatureOptions signature;
  MapperOptions mapper;
  bool no_thumbnails = false;
};

/// Writes the poses of the largest component. Images without stamps get their index as stamp.
void write_map_poses(const Dataset& recording, const Mapper::Result& run,
                     const MapArguments& arguments) {
  std::vector<StampedPose> trajectory;
  const std::size_t component = find_largest_component(run.map);
  TrajectoryUnits units = find_trajectory_units(recording, run.unit);
  const bool has_stamps = units.times == TrajectoryUnits::Times::stamps;
  for (std::size_t i = 0; i < run.map.nodes.size(); ++i) {
    if (run.map.nodes[i].component != component) continue;
    const DatasetEntry& entry = recording.entries[run.observations[i]];
    const double stamp_s = has_stamps ? *entry.stamp_s : static_cast<double>(run.observations[i]);
    append_pose(trajectory, {stamp_s, run.map.nodes[i].pose}, arguments.dataset, entry.file);
  }
  // Numbers of selected images are not those of the recording.
  if (!has_stamps && arguments.pictures.part.every) units.times = TrajectoryUnits::Times::none;
  write_trajectory(*arguments.files.tum, trajectory, units);
}

std::vector<std::size_t> component_sizes(const TopologicalMap& map) {
  std::vector<std::size_t> sizes(count_components(map), 0);
  for (const TopologicalMap::Node& node : map.nodes) ++sizes[node.component];
  return sizes;
}

std::size_t count_closures(const TopologicalMap& map) {
  return static_cast<std::size_t>(
      std::ranges::count(map.edges, Link::Kind::closure, &TopologicalMap::Edge::kind));
}

ordered_json to_json(const RecordedMapComparison& comparison) {
  const MapComparison& positions = comparison.positions;
  ordered_json json{{"nodes", positions.compared},
                    {"procrustes_disparity", positions.shape.value},
                    {"rms_m", positions.truth_from_map.rms_m},
                    {"scale", positions.truth_from_map.scale}};
  json.update(neighbours_json(positions));
  json.update(closures_json(comparison.closures));
  json["odometry_procrustes_disparity"] = to_json_or_null(comparison.odometry_shape_difference);
  return json;
}

void print_comparison(const RecordedMapComparison& comparison, const Mapper::Result& run,
                      Session& session) {
  const MapComparison& positions = comparison.positions;
  session.print("compared with the ground truth: Procrustes disparity (shape difference) " +
                session.bold(format_fixed(positions.shape.value, 4)) + ", " +
                format_fixed(positions.truth_from_map.rms_m, 2) + " m rms" +
                (run.wheels
                     ? ""
                     : " with a free scale of " + format_fixed(positions.truth_from_map.scale, 2)));
  if (comparison.odometry_shape_difference) {
    session.print("the odometry alone: Procrustes disparity " +
                  format_fixed(*comparison.odometry_shape_difference, 4));
  }
  print_neighbours(positions, session);
  print_closures(comparison.closures, session);
}

void print_components(const std::vector<std::size_t>& sizes, Session& session) {
  if (sizes.size() < 2) return;
  std::string text;
  for (const std::size_t size : sizes) text += (text.empty() ? "" : ", ") + std::to_string(size);
  session.print(
      session.red("The map has " + std::to_string(sizes.size()) + " parts that are not connected") +
      ", with these numbers of places: " + text + ".");
  session.print(
      "To connect them, take images at shorter distances, record odometry, or drive through the "
      "same places again.");
}

/// Prints what a unit of length of the map is.
void print_unit(const MapArguments& arguments, const Mapper::Result& run, Session& session) {
  if (run.wheels) return;
  const double height_m = arguments.mapper.odometry.camera_height_m;
  if (height_m > 0.0 && run.unit != LengthUnit::metres) {
    session.print("The camera height was not used: the images do not show enough ground.");
  }
  if (height_m > 0.0 && run.unit == LengthUnit::metres) {
    session.print("Lengths are computed from the image of the ground, " + format_number(height_m) +
                  " m below the camera.");
  } else if (run.unit == LengthUnit::metres && arguments.mapper.is_scale_known) {
    session.print("Lengths are computed from the images: one unit is " +
                  format_number(arguments.mapper.odometry.scale_m) + " m (--scale-m).");
  } else if (run.is_former_scale) {
    session.print("Lengths are in metres, by the scale of the earlier map of " + arguments.memory +
                  ".");
  } else if (run.unit == LengthUnit::metres) {
    session.print(
        "Lengths are those of the odometry; of images without odometry they are computed from the "
        "images, in its scale.");
  } else if (has_positions_from_map(MemoryFile::open(arguments.memory, Access::read_only))) {
    session.print(
        "Lengths are in view steps (median distance between consecutive views). For metres: "
        "panonav scale " +
        arguments.memory + " --distance VIEW VIEW LENGTH");
  } else {
    session.print(
        "The scale of the map is not known (--scale-m, --camera-height-m); it does not change the "
        "positions of the data set.");
  }
}

void print_result(const MapArguments& arguments, const Dataset& recording,
                  const Mapper::Result& run, Session& session) {
  const std::size_t nodes = run.map.nodes.size();
  const double step_ms =
      1e3 * run.mapping_s / static_cast<double>(std::max<std::size_t>(1, recording.entries.size()));
  const auto sizes = component_sizes(run.map);
  const auto comparison = compare_with_ground_truth(recording, run);
  if (session.json()) {
    ordered_json json{{"memory", arguments.memory},
                      {"images", recording.entries.size()},
                      {"nodes", nodes},
                      {"skipped", run.skipped},
                      {"connected_components", sizes},
                      {"closures", count_closures(run.map)},
                      {"unit", run.unit == LengthUnit::metres ? "m" : "view_steps"},
                      {"scale_m", to_json_or_null(run.scale_m)},
                      {"wheels", run.wheels},
                      {"step_ms", step_ms},
                      {"ground_truth", nullptr}};
    if (comparison) json["ground_truth"] = to_json(*comparison);
    session.print(session.json_line(std::move(json)));
    return;
  }
  session.print(session.bold(format_count(nodes, "place")) + " from " +
                format_count(recording.entries.size(), "image") + ", " +
                format_count(count_closures(run.map), "closure") + "; " + format_fixed(step_ms, 2) +
                " ms per image");
  print_components(sizes, session);
  print_unit(arguments, run, session);
  if (comparison) print_comparison(*comparison, run, session);
  if (arguments.files.picture) {
    session.print(*arguments.files.picture + " shows " +
                  (sizes.size() > 1
                       ? "the largest part of the map, " + std::to_string(std::ranges::max(sizes)) +
                             " of " + format_count(nodes, "place")
                       : "the map"));
  }
  session.print(arguments.memory + " contains the map and the views of its places.");
  print_views_without_position(MemoryFile::open(arguments.memory, Access::read_only), session);
  if (arguments.files.tum) {
    session.print(*arguments.files.tum + " contains the poses" +
                  (sizes.size() > 1 ? " of its largest part." : "."));
  }
  if (arguments.files.graph)
    session.print(*arguments.files.graph + " contains the map as a graph.");
}

Mapper::Result map_recording(const Dataset& recording, Mapper& mapper, Session& session) {
  Progress progress(session, "mapping", recording.entries.size());
  SkippedImages skipped(recording.entries.size(), session);
  return mapper.map(
      recording, session.executor(), [&] { progress.advance(); },
      [&](std::size_t, const std::exception_ptr& failure) {
        progress.clear();
        skipped.add(failure);
        progress.advance();
      });
}

/// Maps the recording like `map_recording` and shows the growing map to viewers.
Mapper::Result map_with_viewers(const MapArguments& arguments, const Dataset& recording,
                                Mapper& mapper, Session& session) {
  RunRecord record({.file = std::nullopt, .view = arguments.record.view},
                   std::array{arguments.dataset, arguments.memory}, false, session,
                   {.memory = arguments.memory});
  struct EncodedImage {
    Mapper::EncodedView view;
    recordings::RunMoment moment;
    std::string name;
  };
  GrowingMap shown;
  std::optional<recordings::RunMoment> pending;  // sent with the next image or the finished map
  SkippedImages skipped(recording.entries.size(), session);
  Progress progress(session, "mapping", recording.entries.size());
  process_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        StageClock clock;
        const Observation observation = read_observation(recording.entries[i]);
        clock.stage("reading");
        EncodedImage encoded{mapper.encode(observation), recordings::make_moment(observation, i),
                             observation.name};
        clock.stage("unwarping, signature");
        encoded.moment.panorama = mapper.encoder().panorama(observation);
        clock.stage("for viewers");
        clock.add_to(encoded.moment);
        return encoded;
      },
      [&](std::size_t, EncodedImage&& encoded) {
        if (pending) record.add(std::move(*pending));
        StageClock clock;
        const bool is_node = mapper.add(std::move(encoded.view));
        clock.stage("mapping");
        clock.add_to(encoded.moment);
        shown.add_to(encoded.moment, mapper.current_map(), mapper.current_unit(), is_node,
                     encoded.name);
        pending = std::move(encoded.moment);
        progress.advance();
      },
      [&](std::size_t, const std::exception_ptr& failure) {
        progress.clear();
        skipped.add(failure);
        mapper.skip();
        progress.advance();
      });
  Mapper::Result run = mapper.finish();
  if (pending) {
    shown.finish(*pending, run.map, run.unit);
    record.add(std::move(*pending));
  }
  record.close();
  return run;
}

/// Returns the texts of the report about an image and its node: in a map of several components,
/// also the number of its component, as only the largest one is drawn.
std::vector<std::pair<std::string, std::string>> describe_place(const TopologicalMap& map,
                                                                const std::string& file,
                                                                std::optional<std::size_t> node) {
  std::vector<std::pair<std::string, std::string>> texts{{"image", file}};
  const std::size_t components = count_components(map);
  if (!node || components < 2) return texts;
  const std::size_t component = map.nodes[*node].component;
  texts.emplace_back("part of the map",
                     std::to_string(component + 1) + " of " + std::to_string(components) +
                         (component == find_largest_component(map) ? "" : ", not drawn"));
  return texts;
}

/// Records the finished map and then each image with its pose. Only the largest connected component
/// has poses, as components have no common frame.
void record_map(const MapArguments& arguments, const Dataset& recording, const Mapper::Result& run,
                const ViewEncoder& encoder, viewer::RunPage& replay_page, Session& session) {
  RunRecord record({.file = arguments.record.file, .view = std::nullopt},
                   std::array{arguments.dataset, arguments.memory}, false, session, {});
  if (arguments.record.file && run.unit != LengthUnit::metres && !session.json()) {
    session.print("Positions in " + *arguments.record.file + " are in view steps, not in metres.");
  }
  const TopologicalMap map = to_shown_lengths(run.map, run.unit);
  const std::size_t component = find_largest_component(map);
  std::map<std::size_t, std::size_t> nodes;  // index of the node by index of its image
  std::vector<std::string> names;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    nodes[run.observations[i]] = i;
    names.push_back(recording.entries[run.observations[i]].file);
  }
  Progress progress(session, "recording", recording.entries.size());
  bool is_first = true;
  process_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        const Observation observation = read_observation(recording.entries[i]);
        recordings::RunMoment moment = recordings::make_moment(observation, i);
        moment.panorama = encoder.panorama(observation);
        return moment;
      },
      [&](std::size_t i, recordings::RunMoment&& moment) {
        const auto node = nodes.find(i);
        moment.state = node == nodes.end() ? "between places" : "place of the map";
        moment.sure = node != nodes.end();
        set_unit(moment, run.unit);
        if (moment.sure && map.nodes[node->second].component == component) {
          moment.pose = map.nodes[node->second].pose;
        }
        if (std::exchange(is_first, false)) add_component(moment, map, component, names);
        if (arguments.report) {
          recordings::RunMoment shown = moment;
          shown.truth.reset();  // its frame differs from the map's
          shown.values =
              describe_place(map, recording.entries[i].file,
                             node == nodes.end() ? std::nullopt : std::optional(node->second));
          replay_page.add(shown);
        }
        record.add(std::move(moment));
        progress.advance();
      },
      [&](std::size_t, const std::exception_ptr&) { progress.advance(); });  // named before
  record.close();
}

/// Rejects typed options that have no effect on this recording. Also rejects a camera height, typed
/// or from a config file, if lengths cannot be measured on the ground or odometry gives them.
void reject_options_without_effect(const Arguments& declared, const MapArguments& arguments,
                                   const Dataset& recording, const MemoryHeader& header) {
  const auto has_odometry = [](const DatasetEntry& entry) { return entry.odometry.has_value(); };
  const bool all = std::ranges::all_of(recording.entries, has_odometry);
  const bool wheels = arguments.mapper.mapping.wheels && all;
  if (declared.is_set("visual_odometry", "camera_height_m") && !header.elevations) {
    throw FileError(arguments.dataset,
                    "does not give the elevations of its images' rows, which are needed to find "
                    "the ground; allowed with --camera-height-m: panoramas with elevation_deg, "
                    "equirectangular images, and mirror images with a camera");
  }
  if (declared.is_set("visual_odometry", "camera_height_m"))
    require_known_elevations(recording.source, arguments.dataset);
  if (declared.is_set("visual_odometry", "camera_height_m") && wheels) {
    throw FileError(arguments.dataset,
                    "has odometry, which gives the lengths of all steps; allowed with "
                    "--camera-height-m: recordings without odometry, or --wheels false");
  }
  if (wheels) {
    declared.reject_options({"--scale-m", "--step-deviation"},
                            "when odometry gives the lengths of all steps");
  }
  if (all) declared.reject_options({"--bridge-m"}, "when odometry gives all steps");
  if (std::ranges::none_of(recording.entries, has_odometry)) {
    if (arguments.mapper.mapping.wheels) {
      declared.reject_options({"--wheels"}, "as " + arguments.dataset + " has no odometry");
    }
  }
}

/// Throws FileError if a new map would take positions by an earlier map from views that are not
/// images of the recording.
void require_positions_of_recording(const MapArguments& arguments, const Dataset& recording,
                                    const MemoryFile& memory) {
  if (!has_positions_from_map(memory)) return;
  std::set<std::string> images;
  for (const DatasetEntry& entry : recording.entries) images.insert(entry.file);
  std::size_t others = 0;
  std::string first;
  for (const ViewRecord& view : list_views(memory)) {
    if (!view.info.pose || images.contains(view.info.name)) continue;
    if (others++ == 0) first = view.info.name;
  }
  if (others == 0) return;
  throw FileError(arguments.memory,
                  "has a map with positions of " + format_count(others, "view") + " not in " +
                      arguments.dataset + ", such as " + first +
                      ", which a new map would remove; to map all views, use panonav memorise " +
                      arguments.memory + " " + arguments.dataset +
                      "; allowed for panonav map: another memory, or after panonav forget");
}

ExitCode map(const Arguments& declared, const MapArguments& arguments, Session& session) {
  if (arguments.report) prepare_report_folder(*arguments.report, "map");
  const bool memory_existed = memory_exists(arguments.memory);
  std::optional<MemoryFile> memory;
  if (memory_existed) memory = MemoryFile::open(arguments.memory, Access::read_write);
  const Dataset recording =
      memory ? open_recording(arguments.dataset, arguments.pictures, *memory, session)
             : open_recording(arguments.dataset, arguments.pictures, std::nullopt, session);
  if (memory) {
    require_stored_options(declared, arguments.signature, memory->header().preprocessing, *memory);
    reject_options_without_effect(declared, arguments, recording, memory->header());
    require_positions_of_recording(arguments, recording, *memory);
  } else {
    const MemoryHeader header =
        make_header_from_recording(recording, arguments.signature, {}, session.executor());
    reject_options_without_effect(declared, arguments, recording, header);
    memory = MemoryFile::create(arguments.memory, header);
  }
  MapperOptions options = arguments.mapper;
  options.thumbnails = !arguments.no_thumbnails;
  options.is_scale_known = declared.is_set("visual_odometry", "scale_m");
  Mapper mapper(std::move(*memory), recording.source, options);
  if (memory_existed)
    check_known_views(recording, mapper.memory(), mapper.encoder(), session.executor());
  const Mapper::Result run = arguments.record.view
                                 ? map_with_viewers(arguments, recording, mapper, session)
                                 : map_recording(recording, mapper, session);
  if (arguments.files.tum) write_map_poses(recording, run, arguments);
  if (arguments.files.graph) {
    write_graph(*arguments.files.graph, run.map, [&](ViewId view) {
      const auto found =
          std::ranges::lower_bound(run.map.nodes, view, {}, &TopologicalMap::Node::view);
      const auto number = static_cast<std::size_t>(found - run.map.nodes.begin());
      return recording.entries[run.observations[number]].file;
    });
  }
  viewer::RunPage replay_page("", recording.entries.size());
  if (arguments.record.file || arguments.report) {
    record_map(arguments, recording, run, mapper.encoder(), replay_page, session);
  }
  if (arguments.files.picture) write_map_picture(*arguments.files.picture, recording, run);
  if (arguments.report) {
    write_map_report(*arguments.report, fs::path(arguments.memory).filename().string(), recording,
                     run, replay_page);
  }
  print_result(arguments, recording, run, session);
  if (arguments.report) print_report_path(*arguments.report, session);
  return ExitCode::done;
}

Run declare_map(Arguments& arguments) {
  auto values = std::make_shared<MapArguments>();
  arguments.positional("MEMORY", values->memory,
                       "Memory file (NAME.panonav), to which new views are added");
  arguments.positionals("INPUT", values->inputs,
                        "Data set, folder of images, video (several are joined) or recording with "
                        "images in the order of the drive");
  declare_pictures(arguments, values->pictures);
  values->pictures.check = PictureArguments::Check::heads;
  declare_map_files(arguments, values->files);
  declare_record(arguments, values->record);
  declare_view(arguments, values->record);
  declare_report(arguments, values->report, "a page that replays the drive on the map");
  arguments.hide_from_help({"--record", "--picture"});
  arguments.flag("--no-thumbnails", values->no_thumbnails, "Do not store thumbnails of the views");
  arguments.options("signature", values->signature);
  arguments.options("mapping", values->mapper.mapping);
  arguments.options("visual_odometry", values->mapper.odometry);
  arguments.options("loop_closure", values->mapper.closure, "closure");
  arguments.options("pose_graph", values->mapper.graph, "graph");
  arguments.show_in_help({"--camera-height-m", "--capture-difference"});
  arguments.reject_options_unless(
      {"[loop_closure]", "[pose_graph]"}, [values] { return values->mapper.mapping.close_loops; },
      "with --close-loops false");
  arguments.reject_options_unless(
      {"--distance-components", "--turn-components"},
      [values] { return values->mapper.odometry.rule == VisualOdometryOptions::Rule::published; },
      "without --rule published");
  arguments.reject_options_unless(
      {"--iterations", "--nearer-side"},
      [values] { return values->mapper.odometry.rule == VisualOdometryOptions::Rule::home_vector; },
      "with --rule published");
  arguments.explain_interruption(
      "Views stored so far are kept. To continue, run the same command again.");
  return [values, &arguments](Session& session) {
    values->dataset = values->inputs.front();
    values->pictures.further_videos.assign(values->inputs.begin() + 1, values->inputs.end());
    return map(arguments, *values, session);
  };
}

}  // namespace

Verb map_verb() {
  return {
      "map",
      VerbGroup::maps_and_routes,
      "Make a map from the images of a drive",
      "The images must be in the order of the drive. Each step is computed from two consecutive "
      "images. If the data set has odometry, the steps come from the odometry instead, and the "
      "images only correct the rotations of these steps. When the robot returns to a place, the "
      "map is corrected (loop closure). Without odometry, set --camera-height-m to compute lengths "
      "in metres. Parts of the map that are not connected have no common frame.",
      "  panonav map office.panonav office_run\n"
      "  panonav map office.panonav office_run --report mapped --graphml map.graphml\n"
      "  panonav map walk.panonav walk --camera-height-m 0.6\n"
      "  panonav map walk.panonav walk --capture-difference 0.1 --json",
      declare_map};
}

}  // namespace panonav::command
