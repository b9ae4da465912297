#include <algorithm>
#include <array>

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

constexpr int max_listed_views = 5;

struct ShowArguments {
  std::string memory;
  std::string view;
  std::optional<std::string> thumbnail;
};

/// Returns id, name and distance of another view as JSON; the distance is null if a position is
/// unknown.
ordered_json neighbour_json(const VisualMemory& memory, ViewId view, ViewId other) {
  const auto here = find_position(memory.info(view));
  const auto there = find_position(memory.info(other));
  ordered_json json{
      {"id", other.value}, {"name", memory.info(other).name}, {"distance_m", nullptr}};
  if (here && there && here->floor == there->floor) json["distance_m"] = distance(*here, *there);
  return json;
}

ordered_json list_links(const VisualMemory& memory, ViewId view) {
  constexpr std::array<const char*, 3> kinds{"sequence", "neighbour", "closure"};
  auto links = ordered_json::array();
  for (const Link& link : memory.links()) {
    if (link.a != view && link.b != view) continue;
    links.push_back(neighbour_json(memory, view, link.a == view ? link.b : link.a));
    links.back()["kind"] = kinds[static_cast<std::size_t>(link.kind)];
  }
  return links;
}

ordered_json find_similar_views(const VisualMemory& memory, ViewId view) {
  auto similar = ordered_json::array();
  const auto found =
      memory.search(memory.packed(view), {.top = max_listed_views}, {.excluded_views = {&view, 1}});
  for (const Match& match : found.matches) {
    similar.push_back(neighbour_json(memory, view, match.view));
    similar.back()["dissimilarity"] = match.dissimilarity;
  }
  return similar;
}

ordered_json find_nearest_views(const VisualMemory& memory, ViewId view) {
  std::vector<std::pair<double, ViewId>> near;
  const auto position = find_position(memory.info(view));
  for (const ViewId other : memory.views()) {
    const auto there = find_position(memory.info(other));
    if (position && there && there->floor == position->floor && other != view)
      near.emplace_back(distance(*position, *there), other);
  }
  std::ranges::sort(near);
  auto list = ordered_json::array();
  for (std::size_t i = 0; i < std::min<std::size_t>(near.size(), max_listed_views); ++i) {
    list.push_back(neighbour_json(memory, view, near[i].second));
  }
  return list;
}

ordered_json find_maps(const MemoryFile& file, ViewId view) {
  auto maps = ordered_json::array();
  for (const std::string& name : file.map_names()) {
    const auto map = file.map(name);
    const auto node = std::ranges::find(map->nodes, view, &TopologicalMap::Node::view);
    if (node == map->nodes.end()) continue;
    const auto edges = std::ranges::count_if(map->edges, [&](const TopologicalMap::Edge& edge) {
      return edge.a == view || edge.b == view;
    });
    maps.push_back({{"map", name},
                    {"connected_component", node->component},
                    {"pose", pose_json(node->pose)},
                    {"edges", edges}});
  }
  return maps;
}

void print_view(const ordered_json& view, Session& session) {
  const auto number = [](const ordered_json& value, int digits) {
    return format_fixed(value.get<double>(), digits);
  };
  const auto length = [&](const ordered_json& value) {
    return session.format_length(value.get<double>(), 2);
  };
  const auto name_in = [](const ordered_json& json, const char* key) {
    return to_readable_line(json[key].get<std::string>());
  };
  session.print(session.bold(name_in(view, "name")) + ", view " + view["id"].dump());
  std::string place = "not known";
  if (const auto& pose = view["pose"]; !pose.is_null()) {
    place = "x " + length(pose["x_m"]) + ", y " + length(pose["y_m"]);
    const auto& heading = pose["heading_rad"];
    if (!heading.is_null()) place += ", heading " + format_fixed(degrees(heading), 1) + " degrees";
  }
  session.print("  pose          " + place);
  if (!view["stamp_s"].is_null()) {
    session.print("  stamp         " + number(view["stamp_s"], 3) + " s");
  }
  session.print("  signature     " + view["signature_bytes"].dump() + " bytes");
  const auto& picture = view["thumbnail"];
  session.print("  thumbnail     " +
                (picture.is_null()
                     ? "none"
                     : picture["width_px"].dump() + " x " + picture["height_px"].dump() + " px, " +
                           picture["bytes"].dump() + " bytes"));
  for (const auto& [key, title] :
       {std::pair{"links", "links to"}, {"similar", "most similar"}, {"near", "nearest"}}) {
    std::string begin = title;
    for (const auto& other : view[key]) {
      begin.resize(14, ' ');
      std::string line = "  " + begin + name_in(other, "name");
      if (other.contains("kind")) line += ", " + name_in(other, "kind");
      if (other.contains("dissimilarity")) {
        line += ", dissimilarity " + other["dissimilarity"].dump();
      }
      if (!other["distance_m"].is_null()) line += ", " + length(other["distance_m"]) + " away";
      session.print(line);
      begin.clear();
    }
  }
  for (const auto& map : view["maps"]) {
    session.print("  in " + name_in(map, "map") + ", part " +
                  std::to_string(map["connected_component"].get<std::uint64_t>() + 1) + ": x " +
                  number(map["pose"]["x_m"], 2) + ", y " + number(map["pose"]["y_m"], 2) + ", " +
                  map["edges"].dump() + " edges");
  }
}

ExitCode show(const ShowArguments& arguments, Session& session) {
  const auto file = MemoryFile::open(arguments.memory, Access::read_only);
  session.set_length_unit(read_length_unit(file));
  const ViewId view = find_view_by_name_or_id(file, arguments.view);
  const VisualMemory memory = file.load();
  const ReferenceInfo& info = memory.info(view);
  ordered_json shown{{"memory", arguments.memory},
                     {"id", view.value},
                     {"name", info.name},
                     {"pose", pose_json(info.pose)},
                     {"stamp_s", to_json_or_null(info.stamp_s)},
                     {"signature_bytes", 2 * file.header().shape.size()},
                     {"thumbnail", nullptr},
                     {"links", list_links(memory, view)},
                     {"similar", find_similar_views(memory, view)},
                     {"near", find_nearest_views(memory, view)},
                     {"maps", find_maps(file, view)}};
  const auto bytes = file.thumbnail(view);
  if (!bytes && arguments.thumbnail) {
    throw FileError(arguments.memory,
                    "contains no thumbnail of " + to_readable_line(arguments.view) +
                        "; memorise stores thumbnails unless --no-thumbnails is set");
  }
  if (bytes) {
    std::optional<Image> picture;
    try {
      picture = decode_image(*bytes, "thumbnail of " + to_readable_line(info.name));
    } catch (const FileError&) {
      if (arguments.thumbnail) throw;
    }
    if (arguments.thumbnail) write_png(*arguments.thumbnail, picture->view());
    shown["thumbnail"] = {{"bytes", bytes->size()},
                          {"width_px", picture ? picture->width() : 0},
                          {"height_px", picture ? picture->height() : 0}};
  }
  if (session.json()) {
    session.print(session.json_line(shown));
    return ExitCode::done;
  }
  print_view(shown, session);
  if (arguments.thumbnail) session.print("Thumbnail written to " + *arguments.thumbnail);
  return ExitCode::done;
}

Run declare_show(Arguments& arguments) {
  auto values = std::make_shared<ShowArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.positional("VIEW", values->view, "Name or id of a view");
  arguments.option("-o,--thumbnail FILE", values->thumbnail,
                   "Write the thumbnail of the view into this PNG file");
  arguments.declare_outputs({"--thumbnail"});
  return [values](Session& session) { return show(*values, session); };
}

}  // namespace

Verb show_verb() {
  return {"show",
          VerbGroup::memory,
          "Show all data that a memory stores about a view",
          "The output contains the pose, links, positions in maps and stored size of the view. The "
          "output also lists the five most similar and the five nearest views.",
          "  panonav show office.panonav view_00012.png\n"
          "  panonav show office.panonav 13 -o view_13.png",
          declare_show};
}

}  // namespace panonav::command
