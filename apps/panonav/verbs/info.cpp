#include <algorithm>

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/live_pictures.hpp"
#include "panonav_recordings/recorded_dataset.hpp"
#include "panonav_recordings/video_file.hpp"

namespace panonav::command {

namespace {

std::string_view kind_name(PictureKind kind) {
  switch (kind) {
    case PictureKind::panorama:
      return "panorama";
    case PictureKind::equirectangular:
      return "equirectangular";
    case PictureKind::mirror:
      return "mirror";
  }
  return "panorama";
}

struct NamedRoute {
  std::string name;
  std::size_t lines = 0;
  double length_m = 0.0;
  std::uint64_t bytes = 0;
};

std::vector<NamedRoute> list_routes(const MemoryFile& memory) {
  std::vector<NamedRoute> routes;
  for (auto& name : memory.route_names()) {
    const auto route = memory.route(name);
    if (!route) continue;
    const auto bytes = memory.route_bytes(name);
    routes.push_back({std::move(name), route->size(), route->length_m(), bytes});
  }
  return routes;
}

ordered_json to_json(const MemoryFile& memory, const MemoryFile::Info& info) {
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
                    {"feature_bytes", info.feature_bytes},
                    {"file_bytes", info.file_bytes},
                    {"rows", header.shape.rows},
                    {"components", header.shape.components},
                    {"signature_bytes", 2 * header.shape.size()},
                    {"panorama_columns", header.panorama_columns},
                    {"full_scale", header.full_scale},
                    {"elevations_rad", nullptr},
                    {"kind", kind_name(header.source.kind)},
                    {"preprocessing",
                     {{"masked_rows_top", steps.masked_rows_top},
                      {"masked_rows_bottom", steps.masked_rows_bottom},
                      {"edge_channel", steps.edge_channel},
                      {"remove_mean", steps.remove_mean},
                      {"normalise_gain", steps.normalise_gain}}}};
  auto routes = ordered_json::array();
  for (const auto& [name, lines, length_m, bytes] : list_routes(memory)) {
    routes.push_back({{"name", name}, {"lines", lines}, {"length_m", length_m}, {"bytes", bytes}});
  }
  json["routes"] = std::move(routes);
  if (header.elevations) {
    json["elevations_rad"] = {header.elevations->bottom_rad, header.elevations->top_rad};
  }
  return json;
}

ExitCode print_memory(const std::string& path, Session& session) {
  const auto memory = MemoryFile::open(path, Access::read_only);
  const auto info = memory.info();
  if (session.json()) {
    session.print(json_line(to_json(memory, info)));
    return ExitCode::done;
  }
  const auto& header = memory.header();
  session.print(session.bold(path) + ": " + std::to_string(info.views) + " views, " +
                std::to_string(info.views_with_position) + " with a position, " +
                std::to_string(info.views_with_heading) + " with a heading, " +
                std::to_string(info.links) + " links");
  session.print("  signatures  " + std::to_string(header.shape.rows) + " rows x " +
                std::to_string(header.shape.components) + " components, " +
                std::to_string(2 * header.shape.size()) + " bytes per view");
  if (info.views_with_features > 0) {
    session.print("  features    " + std::to_string(info.views_with_features) +
                  " views with local features, " +
                  std::to_string(info.feature_bytes / info.views_with_features) +
                  " bytes per view");
  }
  session.print("  images      " + std::string(kind_name(header.source.kind)) + ", " +
                std::to_string(header.panorama_columns) + " columns, elevations " +
                (header.elevations
                     ? format_number(degrees(header.elevations->bottom_rad)) + " to " +
                           format_number(degrees(header.elevations->top_rad)) + " degrees"
                     : std::string("unknown")));
  session.print("  file        " + std::to_string(info.file_bytes) + " bytes, format " +
                std::to_string(info.format_version) + ", " + std::to_string(info.thumbnails) +
                " thumbnails");
  for (const auto& [name, lines, length_m, bytes] : list_routes(memory)) {
    session.print("  route       " + name + ": " + std::to_string(lines) + " lines over " +
                  format_fixed(length_m, 1) + " m, " +
                  (length_m > 0.0 ? format_fixed(1e-3 * static_cast<double>(bytes) / length_m, 2) +
                                        " MB per kilometre"
                                  : std::to_string(bytes) + " bytes"));
  }
  return ExitCode::done;
}

ExitCode print_recording(const std::string& path, Session& session) {
  const recordings::RecordingSummary summary = recordings::describe_recording(path);
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
    for (const auto& [topic, time, rate_hz, shows] : summary.topics) {
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
  session.print(session.bold(path) + ": " + std::to_string(messages) + " messages of " +
                std::to_string(summary.topics.size()) + " topics" +
                (summary.time
                     ? " in " +
                           format_fixed(seconds(summary.time->end_ns - summary.time->begin_ns), 1) +
                           " s from " + format_fixed(seconds(summary.time->begin_ns), 3) + " s on"
                     : ""));
  const auto padded = [](std::string text, std::size_t width) {
    text.resize(std::max(width, text.size()), ' ');
    return to_readable_line(text);
  };
  for (const auto& [topic, time, rate_hz, shows] : summary.topics) {
    session.print("  " + padded(topic.name, name_width) + "  " + padded(topic.type, type_width) +
                  "  " + std::to_string(topic.messages) +
                  (rate_hz ? ", " + format_number(*rate_hz, {}, 3) + " per second" : "") +
                  (shows ? ", " + *shows : ""));
  }
  for (const std::string& warning : summary.warnings) session.note(path + ": " + warning);
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
  if (session.json()) session.print(json_line({{"camera", path}, {"formats", listed}}));
  return ExitCode::done;
}

ExitCode print_video(const std::string& path, Session& session) {
  const Dataset video = recordings::read_video(path, {});
  const ImageSize size = read_picture(video.entries.front()).size();
  const double begin_s = *video.entries.front().stamp_s;
  const double end_s = *video.entries.back().stamp_s;
  if (session.json()) {
    session.print(json_line({{"video", path},
                             {"images", video.entries.size()},
                             {"begin_s", begin_s},
                             {"end_s", end_s},
                             {"width", size.width},
                             {"height", size.height}}));
    return ExitCode::done;
  }
  session.print(session.bold(std::to_string(video.entries.size()) + " images") + " of " +
                std::to_string(size.width) + " x " + std::to_string(size.height) + " px, from " +
                format_number(begin_s) + " s to " + format_number(end_s) + " s");
  return ExitCode::done;
}

Run declare_info(Arguments& arguments) {
  auto path = std::make_shared<std::string>();
  arguments.positional(
      "FILE", *path,
      "Memory file, recording (MCAP, rosbag2, ROS 1 bag), video, or camera (/dev/video0)");
  return [path](Session& session) {
    if (path->starts_with("/dev/video")) return print_camera(*path, session);
    if (recordings::is_video(*path)) return print_video(*path, session);
    return recordings::is_recording(*path) ? print_recording(*path, session)
                                           : print_memory(*path, session);
  };
}

}  // namespace

Verb info_verb() {
  return {"info",
          "Show the content of a memory or recording, or the image sizes that a camera offers", "",
          "  panonav info office.panonav\n  panonav info drive.mcap", declare_info};
}

}  // namespace panonav::command
