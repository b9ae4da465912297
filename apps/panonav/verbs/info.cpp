#include <algorithm>
#include <array>
#include <fstream>
#include <map>

#include "cli/texts.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/address.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/live_pictures.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "panonav_recordings/ros_messages.hpp"
#include "panonav_recordings/video_file.hpp"
#include "runs/chain_run.hpp"
#include "runs/described_input.hpp"
#include "runs/orientation_note.hpp"

namespace panonav::command {

namespace {

/// Prints the verbs that take an input, and the next command.
void print_use(const InputUse& use, Session& session) {
  if (session.json()) return;
  std::string verbs;
  for (const auto& verb : use.verbs) verbs += (verbs.empty() ? "" : ", ") + verb;
  constexpr std::size_t column = 14;
  if (!verbs.empty()) session.print("  verbs       " + wrap_text(verbs, column, column));
  if (use.next.empty() || session.quiet()) return;
  std::string line = "Next:";
  for (const auto& word : use.next) line += " " + quote_for_shell(word);
  session.print(line);
}

struct NamedRoute {
  std::string name;
  std::size_t lines = 0;
  double length_m = 0.0;
  std::uint64_t bytes = 0;
  std::optional<ChainSummary> chain;  // nullopt: a route panorama
};

std::vector<NamedRoute> list_routes(const MemoryFile& memory) {
  std::vector<NamedRoute> routes;
  for (auto& name : memory.route_names()) {
    if (memory.route_method(name) == RouteMethod::chain) {
      const ChainSummary chain = summarise_chain(memory.chain(name).value());
      routes.push_back({std::move(name), 0, chain.length_m, chain.bytes, chain});
      continue;
    }
    const auto bytes = memory.route_bytes(name);
    const RoutePanorama route = memory.route(name).value();
    routes.push_back({std::move(name), route.size(), route.length_m(), bytes, std::nullopt});
  }
  return routes;
}

/// Returns the unit of a route's lengths, which may differ from that of the memory's positions.
LengthUnit read_route_unit(const MemoryFile& memory, const std::string& name) {
  if (memory.route_method(name) == RouteMethod::chain) return LengthUnit::metres;
  const int columns = memory.route(name).value().columns();
  return read_route_source(memory, name, columns).assumed_unit_m ? LengthUnit::view_steps
                                                                 : LengthUnit::metres;
}

/// True if the memory has a map all of whose views have a stamp, which the verb evaluate needs.
bool can_be_evaluated(const MemoryFile& memory) {
  const auto map = memory.map(map_name);
  if (!map || map->nodes.empty() || memory.path().extension() != ".panonav") return false;
  const VisualMemory views = memory.load();
  return std::ranges::all_of(map->nodes, [&](const TopologicalMap::Node& node) {
    return views.info(node.view).stamp_s.has_value();
  });
}

/// Returns the verbs that take the memory: not those for routes, changes, positions or a map that
/// it does not have.
std::vector<std::string> find_memory_verbs(const MemoryFile& memory) {
  std::vector<std::string> verbs = list_verbs_that_take(InputKind::memory);
  if (memory.route_names().empty()) std::erase(verbs, "route follow");
  if (memory.history().empty()) std::erase(verbs, "undo");
  if (!has_positions_from_map(memory)) std::erase(verbs, "scale");
  if (!can_be_evaluated(memory)) std::erase(verbs, "evaluate");
  if (memory.info().views_with_heading < std::uint64_t{ObservationModel::min_views}) {
    std::erase(verbs, "track");
  }
  return verbs;
}

/// Returns the number of views on each floor that has a name.
std::map<std::string, std::size_t> count_views_by_floor(const MemoryFile& memory) {
  std::map<std::string, std::size_t> counts;
  for (const std::string& name : memory.names()) {
    if (const auto floor = floor_of(name); !floor.empty()) ++counts[std::string(floor)];
  }
  return counts;
}

ordered_json to_json(const MemoryFile& memory, const MemoryFile::Info& info,
                     const OrientationCheck& orientation) {
  const auto& header = memory.header();
  const auto& steps = header.preprocessing;
  ordered_json json{{"memory", memory.path().string()},
                    {"format_version", info.format_version},
                    {"views", info.views},
                    {"views_with_position", info.views_with_position},
                    {"views_with_heading", info.views_with_heading},
                    {"links", info.links},
                    {"thumbnails", info.thumbnails},
                    {"views_with_features", info.views_with_features},
                    {"narrow_features", has_narrow_features(memory)},
                    {"floors", count_views_by_floor(memory)},
                    {"feature_bytes", info.feature_bytes},
                    {"file_bytes", info.file_bytes},
                    {"rows", header.shape.rows},
                    {"components", header.shape.components},
                    {"signature_bytes", 2 * header.shape.size()},
                    {"panorama_columns", header.panorama_columns},
                    {"full_scale", header.full_scale},
                    {"elevations_rad", nullptr},
                    {"kind", to_string(header.source.kind)},
                    {"preprocessing",
                     {{"masked_rows_top", steps.masked_rows_top},
                      {"masked_rows_bottom", steps.masked_rows_bottom},
                      {"edge_channel", steps.edge_channel},
                      {"remove_mean", steps.remove_mean},
                      {"normalise_gain", steps.normalise_gain}}}};
  json["verbs"] = find_memory_verbs(memory);
  auto routes = ordered_json::array();
  for (const auto& [name, lines, length_m, bytes, chain] : list_routes(memory)) {
    if (chain) {
      ordered_json route{{"name", name}, {"method", "chain"}};
      add_chain_fields(route, *chain);
      routes.push_back(std::move(route));
      continue;
    }
    const char* const length_key =
        read_route_unit(memory, name) == LengthUnit::metres ? "length_m" : "length_steps";
    routes.push_back({{"name", name},
                      {"method", "panorama"},
                      {"lines", lines},
                      {length_key, length_m},
                      {"bytes", bytes}});
  }
  json["routes"] = std::move(routes);
  json["orientation_fault"] = orientation_json(orientation);
  json["map"] = nullptr;
  if (const auto map = describe_map(memory)) {
    json["map"] = {{"unit", map->unit == LengthUnit::metres ? "m" : "view_steps"},
                   {"views", map->views},
                   {"part_sizes", map->part_sizes}};
  }
  if (header.elevations) {
    json["elevations_rad"] = {header.elevations->bottom_rad, header.elevations->top_rad};
  }
  return json;
}

/// Prints what poses show of the stated orientation; nothing if they show nothing.
void print_orientation(const OrientationCheck& check, const PictureSource& source,
                       const std::string& recording, Session& session) {
  if (check.fault) {
    session.print("  " + session.red("orientation") + " " +
                  describe_fault(check, source, recording));
  } else if (!check.explanation.empty()) {
    session.print("  orientation " + check.explanation);
  }
}

/// Prints what the memory's map contains, and whether the positions of the views come from it.
void print_map(const MemoryFile& memory, Session& session) {
  if (const auto map = describe_map(memory)) {
    session.print(
        "  map         " + format_count(map->views, "view") + " in " +
        format_count(map->part_sizes.size(), "part") +
        (map->part_sizes.size() == 1 ? "" : " that are not connected") + ", positions in " +
        (map->unit == LengthUnit::metres ? "metres" : "view steps (panonav scale makes metres)"));
  } else if (const auto beside = memory.map(map_name)) {
    session.print("  map         " + format_count(beside->nodes.size(), "view") +
                  "; the positions of the views are not those of the map");
  }
}

ExitCode print_memory(const std::string& path, Session& session) {
  const auto memory = MemoryFile::open(path, Access::read_only);
  const auto info = memory.info();
  const OrientationCheck orientation = check_orientation(memory);
  session.set_length_unit(read_length_unit(memory));
  if (session.json()) {
    session.print(json_line(to_json(memory, info, orientation)));
    return ExitCode::done;
  }
  const auto& header = memory.header();
  session.print(session.bold(path) + ": " + format_count(info.views, "view") + ", " +
                std::to_string(info.views_with_position) + " with a position, " +
                std::to_string(info.views_with_heading) + " with a heading, " +
                format_count(info.links, "link"));
  session.print("  signatures  " + std::to_string(header.shape.rows) + " rows x " +
                std::to_string(header.shape.components) + " components, " +
                std::to_string(2 * header.shape.size()) + " bytes per view");
  for (const auto& [floor, views] : count_views_by_floor(memory)) {
    session.print("  floor       " + to_readable_line(floor) + ", " + format_count(views, "view"));
  }
  if (info.views_with_features > 0) {
    session.print(
        "  features    " + format_count(info.views_with_features, "view") +
        " with local features, " + std::to_string(info.feature_bytes / info.views_with_features) +
        " bytes per view" + (has_narrow_features(memory) ? ", also for narrow images" : ""));
  }
  session.print("  images      " + std::string(to_string(header.source.kind)) + ", " +
                std::to_string(header.panorama_columns) + " columns, elevations " +
                (header.elevations
                     ? format_number(degrees(header.elevations->bottom_rad)) + " to " +
                           format_number(degrees(header.elevations->top_rad)) + " degrees"
                     : std::string("unknown")));
  session.print("  file        " + std::to_string(info.file_bytes) + " bytes" +
                (info.views > 0 ? ", " + std::to_string(info.file_bytes / info.views) + " per view"
                                : std::string()) +
                ", format " + std::to_string(info.format_version) + ", " +
                format_count(info.thumbnails, "thumbnail"));
  print_orientation(orientation, header.source, "", session);
  print_map(memory, session);
  if (info.views > 0 && info.views_with_position == 0) {
    session.print(
        "  positions   none: localise names the nearest view, but gives no position; panonav "
        "memorise makes a map of images taken every 20 to 50 cm");
  }
  for (const auto& [name, lines, length_m, bytes, chain] : list_routes(memory)) {
    session.set_length_unit(read_route_unit(memory, name));
    if (chain) {
      session.print("  route       " + name + ": " + format_chain(*chain, session));
      continue;
    }
    session.print(
        "  route       " + name + ": " + format_count(lines, "line") + " over " +
        session.format_length(length_m, 1) + ", " +
        (length_m > 0.0 && session.length_unit() == LengthUnit::metres
             ? format_fixed(1e-3 * static_cast<double>(bytes) / length_m, 2) + " MB per kilometre"
             : std::to_string(bytes) + " bytes"));
  }
  InputUse use{find_memory_verbs(memory), {"panonav", "localise", path, "INPUT"}};
  if (info.views == 0) use.next = {"panonav", "memorise", path, "INPUT"};
  print_use(use, session);
  return ExitCode::done;
}

/// Returns the command that stores images of a guessed kind in a memory, or that calibrates their
/// camera if they may be those of a mirror.
std::vector<std::string> make_first_command(const std::string& input, ImageSize size) {
  const GuessedKind guess = guess_kind(size);
  if (guess.kind.empty()) return {"panonav", "calibrate", input, "-o", "camera.toml"};
  return make_memorise_command(input, guess.kind);
}

/// True if a topic has poses, which the verb evaluate reads.
bool has_poses(const recordings::RecordingSummary& summary) {
  namespace ros = recordings::ros;
  constexpr std::array types{
      ros::Odometry::type,         ros::PoseStamped::type,  ros::PoseWithCovarianceStamped::type,
      ros::TransformStamped::type, ros::PointStamped::type, ros::TFMessage::type};
  return std::ranges::any_of(summary.topics, [&](const recordings::TopicSummary& each) {
    return each.topic.messages > 0 && std::ranges::find(types, each.topic.type) != types.end();
  });
}

/// Verbs take a recording that has images which panonav can read.
InputUse find_use(const std::string& path, const recordings::RecordingSummary& summary) {
  InputUse use;
  std::int64_t largest_px = 0;
  for (const recordings::TopicSummary& each : summary.topics) {
    if (!each.shows) continue;
    if (use.verbs.empty()) use.verbs = list_verbs_that_take(InputKind::recording);
    const std::int64_t area_px = each.size ? std::int64_t{each.size->width} * each.size->height : 0;
    if (area_px <= largest_px) continue;
    largest_px = area_px;
    use.next = make_first_command(path, *each.size);
  }
  if (!has_poses(summary)) std::erase(use.verbs, "evaluate");
  return use;
}

ExitCode print_recording(const std::string& path, Session& session) {
  const recordings::RecordingSummary summary = recordings::describe_recording(path);
  const InputUse use = find_use(path, summary);
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  if (session.json()) {
    ordered_json json{{"recording", path}, {"begin_s", nullptr}, {"end_s", nullptr}};
    const auto add_span = [&](ordered_json& to, const std::optional<recordings::TimeSpan>& span) {
      if (!span) return;
      to["begin_s"] = seconds(span->begin_ns);
      to["end_s"] = seconds(span->end_ns);
    };
    add_span(json, summary.time);
    auto topics = ordered_json::array();
    for (const auto& [topic, time, rate_hz, shows, size] : summary.topics) {
      ordered_json each{{"name", topic.name},    {"type", topic.type}, {"messages", topic.messages},
                        {"begin_s", nullptr},    {"end_s", nullptr},   {"rate_hz", nullptr},
                        {"first_image", nullptr}};
      add_span(each, time);
      if (rate_hz) each["rate_hz"] = *rate_hz;
      if (shows) each["first_image"] = *shows;
      topics.push_back(std::move(each));
    }
    json["topics"] = std::move(topics);
    json["warnings"] = summary.warnings;
    json["verbs"] = use.verbs;
    session.print(json_line(json));
    return ExitCode::done;
  }
  std::uint64_t messages = 0;
  std::size_t name_width = 0;
  std::size_t type_width = 0;
  for (const auto& each : summary.topics) {
    messages += each.topic.messages;
    name_width = std::max(name_width, each.topic.name.size());
    type_width = std::max(type_width, each.topic.type.size());
  }
  session.print(session.bold(path) + ": " + format_count(messages, "message") + " of " +
                format_count(summary.topics.size(), "topic") +
                (summary.time
                     ? " in " +
                           format_fixed(seconds(summary.time->end_ns - summary.time->begin_ns), 1) +
                           " s from " + format_fixed(seconds(summary.time->begin_ns), 3) + " s on"
                     : ""));
  const auto padded = [](std::string text, std::size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return to_readable_line(text);
  };
  for (const auto& [topic, time, rate_hz, shows, size] : summary.topics) {
    session.print("  " + padded(topic.name, name_width) + "  " + padded(topic.type, type_width) +
                  "  " + std::to_string(topic.messages) +
                  (rate_hz ? ", " + format_number(*rate_hz, {}, 3) + " per second" : "") +
                  (shows ? ", " + *shows : ""));
  }
  if (use.verbs.empty()) {
    session.print("  no verb takes it: " +
                  std::string(messages == 0
                                  ? "it is empty; it was probably not written completely"
                                  : "it has no images that panonav reads (docs/recordings.md)"));
  }
  print_use(use, session);
  for (const std::string& warning : summary.warnings)
    session.note(warning.starts_with(path + ": ") ? warning : path + ": " + warning);
  return ExitCode::done;
}

ExitCode print_camera(const std::string& path, Session& session) {
  const auto formats = recordings::list_camera_formats(path);
  auto listed = ordered_json::array();
  for (const recordings::CameraFormat& format : formats) {
    auto sizes = ordered_json::array();
    std::string line = format.pixels + (format.is_supported ? "" : "  (not used)");
    for (const auto& [width, height] : format.sizes) {
      sizes.push_back({{"width", width}, {"height", height}});
      line += "  " + std::to_string(width) + " x " + std::to_string(height);
    }
    listed.push_back(
        {{"pixels", format.pixels}, {"usable", format.is_supported}, {"sizes", sizes}});
    if (!session.json()) session.print(line);
  }
  const InputUse use{list_verbs_that_take(InputKind::live),
                     {"panonav", "localise", "MEMORY", path}};
  print_use(use, session);
  if (session.json()) {
    session.print(json_line({{"camera", path}, {"formats", listed}, {"verbs", use.verbs}}));
  }
  return ExitCode::done;
}

ExitCode print_video(const std::string& path, Session& session) {
  const Dataset video = recordings::read_video(path, {});
  const ImageSize size = read_picture(video.entries.front()).size();
  const double begin_s = *video.entries.front().stamp_s;
  const double end_s = *video.entries.back().stamp_s;
  const InputUse use{list_verbs_that_take(InputKind::video), make_first_command(path, size)};
  if (session.json()) {
    session.print(json_line({{"video", path},
                             {"images", video.entries.size()},
                             {"begin_s", begin_s},
                             {"end_s", end_s},
                             {"width", size.width},
                             {"height", size.height},
                             {"verbs", use.verbs}}));
    return ExitCode::done;
  }
  session.print(session.bold(format_count(video.entries.size(), "image")) + " of " +
                std::to_string(size.width) + " x " + std::to_string(size.height) + " px, from " +
                format_number(begin_s) + " s to " + format_number(end_s) + " s");
  for (const std::string& warning : video.warnings) session.print("  " + warning);
  session.print("  " + std::string(guess_kind(size).text));
  print_use(use, session);
  return ExitCode::done;
}

ExitCode print_described(const std::string& path, Session& session) {
  const DescribedInput described = describe_input(path);
  OrientationCheck orientation;
  std::optional<Dataset> recording;
  if (!described.posed_dataset.empty()) {
    recording = open_input(described.posed_dataset);
    orientation = check_orientation(*recording, session.executor());
  }
  if (session.json()) {
    session.print(json_line({{"input", path},
                             {"type", described.type},
                             {"summary", described.summary},
                             {"bytes", described.bytes},
                             {"images", described.images},
                             {"facts", described.facts},
                             {"orientation_fault", orientation_json(orientation)},
                             {"verbs", described.use.verbs}}));
    return ExitCode::done;
  }
  session.print(session.bold(path) + ": " + described.type + ", " + described.summary);
  if (described.bytes > 0) {
    session.print("  size        " + std::to_string(described.bytes) + " bytes");
  }
  for (const auto& fact : described.facts) session.print("  " + fact);
  if (recording)
    print_orientation(orientation, recording->source, described.posed_dataset, session);
  print_use(described.use, session);
  return ExitCode::done;
}

/// True if the first bytes are those of a database, as memories are.
bool is_database(const std::string& path) {
  constexpr std::string_view magic = "SQLite format 3";
  std::string head(magic.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(head.data(), static_cast<std::streamsize>(head.size()));
  return head == magic;
}

ExitCode info(const std::string& path, Session& session) {
  if (path.starts_with("/dev/video")) return print_camera(path, session);
  if (recordings::is_live(path)) return print_described(path, session);
  if (is_address(path)) return print_memory(path, session);
  if (recordings::is_video(path)) return print_video(path, session);
  if (recordings::is_recording(path)) return print_recording(path, session);
  return is_database(path) ? print_memory(path, session) : print_described(path, session);
}

Run declare_info(Arguments& arguments) {
  auto path = std::make_shared<std::string>();
  arguments.positional(
      "FILE", *path,
      "Any file or folder, such as a memory, an image, a folder of images, a data set, a video, a "
      "recording, a camera file, a trajectory, a world or a report; the address of a memory or of "
      "a "
      "live source; or a camera (/dev/video0)");
  return [path](Session& session) { return info(*path, session); };
}

}  // namespace

Verb info_verb() {
  return {
      "info",
      VerbGroup::first_steps,
      "Say what a file, folder or address is and which verbs read it",
      "The verb prints the type, the content, the verbs that take it, and the next command. A live "
      "source is not opened. The exit code is 2 if no verb takes the file; one line then "
      "describes its content.",
      "  panonav info photos\n  panonav info office.panonav\n  panonav info drive.mcap",
      declare_info};
}

}  // namespace panonav::command
