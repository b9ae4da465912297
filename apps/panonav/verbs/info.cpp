#include <memory>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/storage/memory_file.hpp"

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

std::vector<NamedRoute> routes_of(const MemoryFile& memory) {
  std::vector<NamedRoute> routes;
  for (auto& name : memory.route_names()) {
    const auto route = memory.route(name);
    if (!route) continue;
    const auto bytes = memory.route_bytes(name);
    routes.push_back({std::move(name), route->size(), route->length_m(), bytes});
  }
  return routes;
}

ordered_json as_json(const MemoryFile& memory, const MemoryFileInfo& info) {
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
  json["unused_chains"] = info.unused_chains;
  auto routes = ordered_json::array();
  for (const auto& [name, lines, length_m, bytes] : routes_of(memory)) {
    routes.push_back({{"name", name}, {"lines", lines}, {"length_m", length_m}, {"bytes", bytes}});
  }
  json["routes"] = std::move(routes);
  if (header.elevations) {
    json["elevations_rad"] = {header.elevations->bottom_rad, header.elevations->top_rad};
  }
  return json;
}

ExitCode show(const std::string& path, Session& session) {
  const auto memory = MemoryFile::open(path, Access::read_only);
  const auto info = memory.info();
  if (session.json()) {
    session.print(json_line(as_json(memory, info)));
    return ExitCode::done;
  }
  const auto& header = memory.header();
  session.print(session.strong(path) + ": " + std::to_string(info.views) + " views, " +
                std::to_string(info.views_with_position) + " with a position, " +
                std::to_string(info.views_with_heading) + " with a heading, " +
                std::to_string(info.links) + " links");
  session.print("  signatures  " + std::to_string(header.shape.rows) + " rows x " +
                std::to_string(header.shape.components) + " components, " +
                std::to_string(2 * header.shape.size()) + " bytes a view");
  if (info.views_with_features > 0) {
    session.print("  features    " + std::to_string(info.views_with_features) +
                  " views with local features, " +
                  std::to_string(info.feature_bytes / info.views_with_features) + " bytes a view");
  }
  session.print("  pictures    " + std::string(kind_name(header.source.kind)) + ", " +
                std::to_string(header.panorama_columns) + " columns, elevations " +
                (header.elevations
                     ? short_number(degrees(header.elevations->bottom_rad)) + " to " +
                           short_number(degrees(header.elevations->top_rad)) + " degrees"
                     : std::string("unknown")));
  session.print("  file        " + std::to_string(info.file_bytes) + " bytes, format " +
                std::to_string(info.format_version) + ", " + std::to_string(info.thumbnails) +
                " thumbnails");
  if (info.unused_chains > 0) {
    session.print("  chains      " + std::to_string(info.unused_chains) +
                  " of snapshots, saved by an earlier version; this version does not use them");
  }
  for (const auto& [name, lines, length_m, bytes] : routes_of(memory)) {
    session.print("  route       " + name + ": " + std::to_string(lines) + " lines over " +
                  fixed(length_m, 1) + " m, " +
                  (length_m > 0.0
                       ? fixed(1e-3 * static_cast<double>(bytes) / length_m, 2) + " MB a kilometre"
                       : std::to_string(bytes) + " bytes"));
  }
  return ExitCode::done;
}

Run declare_info(Arguments& arguments) {
  auto path = std::make_shared<std::string>();
  arguments.positional("MEMORY", *path, "Memory file");
  return [path](Session& session) { return show(*path, session); };
}

}  // namespace

Verb info_verb() {
  return {"info", "Show what a memory holds", "", "  panonav info office.panonav", declare_info};
}

}  // namespace panonav::command
