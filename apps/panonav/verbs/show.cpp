#include <algorithm>
#include <array>

#include "cli/verbs.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

namespace {

constexpr int nearest = 5;

struct ShowArguments {
  std::string memory;
  std::string view;
  std::optional<std::string> thumbnail;
};

/// Another view as seen from the one that is shown.
ordered_json neighbour(const VisualMemory& memory, ViewId view, ViewId other) {
  const auto& here = memory.info(view).pose;
  const auto& there = memory.info(other).pose;
  ordered_json json{
      {"id", other.value}, {"name", memory.info(other).name}, {"distance_m", nullptr}};
  if (here && there) json["distance_m"] = distance(here->position(), there->position());
  return json;
}

ordered_json links_of(const VisualMemory& memory, ViewId view) {
  constexpr std::array<const char*, 3> kinds{"sequence", "neighbour", "closure"};
  auto links = ordered_json::array();
  for (const Link& link : memory.links()) {
    if (link.a != view && link.b != view) continue;
    links.push_back(neighbour(memory, view, link.a == view ? link.b : link.a));
    links.back()["kind"] = kinds[static_cast<std::size_t>(link.kind)];
  }
  return links;
}

ordered_json similar_to(const VisualMemory& memory, ViewId view) {
  auto similar = ordered_json::array();
  const auto found =
      memory.search(memory.packed(view), {.top = nearest}, {.excluded_views = {&view, 1}});
  for (const Match& match : found.matches) {
    similar.push_back(neighbour(memory, view, match.view));
    similar.back()["dissimilarity"] = match.dissimilarity;
  }
  return similar;
}

ordered_json near_to(const VisualMemory& memory, ViewId view) {
  std::vector<std::pair<double, ViewId>> near;
  const auto& pose = memory.info(view).pose;
  for (const ViewId other : memory.views()) {
    const auto& there = memory.info(other).pose;
    if (pose && there && other != view) {
      near.emplace_back(distance(pose->position(), there->position()), other);
    }
  }
  std::ranges::sort(near);
  auto list = ordered_json::array();
  for (std::size_t i = 0; i < std::min<std::size_t>(near.size(), nearest); ++i) {
    list.push_back(neighbour(memory, view, near[i].second));
  }
  return list;
}

ordered_json maps_with(const MemoryFile& file, ViewId view) {
  auto maps = ordered_json::array();
  for (const std::string& name : file.map_names()) {
    const auto map = file.map(name);
    const auto node = std::ranges::find(map->nodes, view, &MapNode::view);
    if (node == map->nodes.end()) continue;
    const auto edges = std::ranges::count_if(
        map->edges, [&](const MapEdge& edge) { return edge.a == view || edge.b == view; });
    maps.push_back({{"map", name},
                    {"connected_component", node->component},
                    {"pose", pose_json(node->pose)},
                    {"edges", edges}});
  }
  return maps;
}

void tell(const ordered_json& view, Session& session) {
  const auto number = [](const ordered_json& value, int digits) {
    return format_fixed(value.get<double>(), digits);
  };
  const auto name_in = [](const ordered_json& json, const char* key) {
    return to_readable_line(json[key].get<std::string>());
  };
  session.print(session.strong(name_in(view, "name")) + ", view " + view["id"].dump());
  std::string place = "not known";
  if (const auto& pose = view["pose"]; !pose.is_null()) {
    place = "x " + number(pose["x_m"], 2) + " m, y " + number(pose["y_m"], 2) + " m";
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
      if (!other["distance_m"].is_null()) line += ", " + number(other["distance_m"], 2) + " m away";
      session.print(line);
      begin.clear();
    }
  }
  for (const auto& map : view["maps"]) {
    session.print("  in " + name_in(map, "map") + ", component " +
                  map["connected_component"].dump() + ": x " + number(map["pose"]["x_m"], 2) +
                  ", y " + number(map["pose"]["y_m"], 2) + ", " + map["edges"].dump() + " edges");
  }
}

ExitCode show(const ShowArguments& wanted, Session& session) {
  const auto file = MemoryFile::open(wanted.memory, Access::read_only);
  const ViewId view = find_view_by_name_or_id(file, wanted.view);
  const VisualMemory memory = file.load();
  const ReferenceInfo& info = memory.info(view);
  ordered_json shown{{"memory", wanted.memory},
                     {"id", view.value},
                     {"name", info.name},
                     {"pose", nullptr},
                     {"stamp_s", or_null(info.stamp_s)},
                     {"signature_bytes", 2 * file.header().shape.size()},
                     {"thumbnail", nullptr},
                     {"links", links_of(memory, view)},
                     {"similar", similar_to(memory, view)},
                     {"near", near_to(memory, view)},
                     {"maps", maps_with(file, view)}};
  if (const auto& pose = info.pose) {
    shown["pose"] = {
        {"x_m", pose->x_m}, {"y_m", pose->y_m}, {"heading_rad", or_null(pose->heading_rad)}};
  }
  const auto bytes = file.thumbnail(view);
  if (!bytes && wanted.thumbnail) {
    throw FileError(wanted.memory, "holds no thumbnail of " + to_readable_line(wanted.view) +
                                       "; memorise keeps them unless told --no-thumbnails");
  }
  if (bytes) {
    std::optional<Image> picture;
    try {
      picture = decode_image(*bytes, "thumbnail of " + to_readable_line(info.name));
    } catch (const FileError&) {
      if (wanted.thumbnail) throw;
    }
    if (wanted.thumbnail) write_png(*wanted.thumbnail, picture->view());
    shown["thumbnail"] = {{"bytes", bytes->size()},
                          {"width_px", picture ? picture->width() : 0},
                          {"height_px", picture ? picture->height() : 0}};
  }
  if (session.json()) {
    session.print(json_line(shown));
    return ExitCode::done;
  }
  tell(shown, session);
  if (wanted.thumbnail) session.print("Thumbnail written to " + *wanted.thumbnail);
  return ExitCode::done;
}

Run declare_show(Arguments& arguments) {
  auto wanted = std::make_shared<ShowArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positional("VIEW", wanted->view, "Name or id of a view");
  arguments.option("-o,--thumbnail FILE", wanted->thumbnail,
                   "Write its thumbnail into this PNG file");
  return [wanted](Session& session) { return show(*wanted, session); };
}

}  // namespace

Verb show_verb() {
  return {"show", "Show all that a memory knows of a view",
          "The answer has the view's pose, links and place in maps, its size, and the five views "
          "that are most similar and nearest to it.",
          "  panonav show office.panonav view_00012.png\n"
          "  panonav show office.panonav 13 -o view_13.png",
          declare_show};
}

}  // namespace panonav::command
