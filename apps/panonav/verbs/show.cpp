#include <algorithm>
#include <cmath>
#include <memory>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/named_view.hpp"
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
struct Neighbour {
  ViewId view;
  std::optional<std::uint32_t> dissimilarity;
  std::optional<double> distance_m;
  std::string how;  ///< the kind of link, or the map's edge
};

struct Shown {
  ViewRecord record;
  std::uint64_t signature_bytes = 0;
  std::vector<std::uint8_t> thumbnail;
  ImageSize thumbnail_size;
  std::vector<Neighbour> links, similar, near;
  struct Node {
    std::string map;
    MapNode node;
    std::size_t edges = 0;
  };
  std::vector<Node> nodes;
};

std::string_view kind_name(LinkKind kind) {
  switch (kind) {
    case LinkKind::sequence:
      return "sequence";
    case LinkKind::neighbour:
      return "neighbour";
    case LinkKind::closure:
      return "closure";
  }
  return "sequence";
}

Shown gather(const MemoryFile& file, const VisualMemory& memory, ViewId view) {
  Shown shown;
  const auto records = list_views(file);
  shown.record = *std::ranges::find(records, view, &ViewRecord::view);
  shown.signature_bytes = 2 * file.header().shape.size();
  if (auto bytes = file.thumbnail(view)) {
    shown.thumbnail = std::move(*bytes);
    try {
      const Image picture = decode_image(shown.thumbnail, "thumbnail");
      shown.thumbnail_size = {picture.width(), picture.height()};
    } catch (const FileError&) {  // shown as 0 x 0; --thumbnail says what is wrong
    }
  }
  const auto& pose = shown.record.info.pose;
  const auto neighbour = [&](ViewId other, std::string how) {
    Neighbour made{other, std::nullopt, std::nullopt, std::move(how)};
    const auto& there = memory.info(other).pose;
    if (pose && there) made.distance_m = distance(pose->position(), there->position());
    return made;
  };
  for (const Link& link : memory.links()) {
    if (link.a != view && link.b != view) continue;
    shown.links.push_back(
        neighbour(link.a == view ? link.b : link.a, std::string(kind_name(link.kind))));
  }
  const auto found =
      memory.search(memory.packed(view), {.top = nearest}, {.excluded_views = {&view, 1}});
  for (const Match& match : found.matches) {
    shown.similar.push_back(neighbour(match.view, ""));
    shown.similar.back().dissimilarity = match.dissimilarity;
  }
  if (pose) {
    for (const ViewId other : memory.views()) {
      if (other != view && memory.info(other).pose) shown.near.push_back(neighbour(other, ""));
    }
    std::ranges::stable_sort(shown.near, {}, &Neighbour::distance_m);
    shown.near.resize(std::min<std::size_t>(shown.near.size(), nearest));
  }
  for (const std::string& name : file.map_names()) {
    const auto map = file.map(name);
    const auto node = std::ranges::find(map->nodes, view, &MapNode::view);
    if (node == map->nodes.end()) continue;
    const auto edges = std::ranges::count_if(
        map->edges, [&](const MapEdge& edge) { return edge.a == view || edge.b == view; });
    shown.nodes.push_back({name, *node, static_cast<std::size_t>(edges)});
  }
  return shown;
}

ordered_json as_json(const std::string& path, const Shown& shown, const VisualMemory& memory) {
  const auto& info = shown.record.info;
  const auto list = [&](const std::vector<Neighbour>& views) {
    auto array = ordered_json::array();
    for (const auto& [view, dissimilarity, distance_m, how] : views) {
      ordered_json json{{"id", view.value}, {"name", memory.info(view).name}};
      if (!how.empty()) json["kind"] = how;
      if (dissimilarity) json["dissimilarity"] = *dissimilarity;
      json["distance_m"] = or_null(distance_m);
      array.push_back(std::move(json));
    }
    return array;
  };
  ordered_json json{{"memory", path},
                    {"id", shown.record.view.value},
                    {"name", info.name},
                    {"pose", nullptr},
                    {"stamp_s", or_null(info.stamp_s)},
                    {"signature_bytes", shown.signature_bytes},
                    {"thumbnail", nullptr},
                    {"links", list(shown.links)},
                    {"similar", list(shown.similar)},
                    {"near", list(shown.near)},
                    {"maps", ordered_json::array()}};
  if (info.pose) {
    json["pose"] = {{"x_m", info.pose->x_m},
                    {"y_m", info.pose->y_m},
                    {"heading_rad", or_null(info.pose->heading_rad)}};
  }
  if (!shown.thumbnail.empty()) {
    json["thumbnail"] = {{"bytes", shown.thumbnail.size()},
                         {"width_px", shown.thumbnail_size.width},
                         {"height_px", shown.thumbnail_size.height}};
  }
  for (const auto& [map, node, edges] : shown.nodes) {
    json["maps"].push_back({{"map", map},
                            {"connected_component", node.component},
                            {"pose", pose_json(node.pose)},
                            {"edges", edges}});
  }
  return json;
}

std::string pose_text(const std::optional<ReferencePose>& pose) {
  if (!pose) return "not known";
  std::string text = "x " + fixed(pose->x_m, 2) + " m, y " + fixed(pose->y_m, 2) + " m";
  if (pose->heading_rad) text += ", heading " + fixed(degrees(*pose->heading_rad), 1) + " degrees";
  return text;
}

void tell(const Shown& shown, const VisualMemory& memory, Session& session) {
  const auto& info = shown.record.info;
  session.print(session.strong(readable_line(info.name)) + ", view " +
                std::to_string(shown.record.view.value));
  session.print("  pose          " + pose_text(info.pose));
  if (info.stamp_s) session.print("  stamp         " + fixed(*info.stamp_s, 3) + " s");
  session.print("  signature     " + std::to_string(shown.signature_bytes) + " bytes");
  session.print("  thumbnail     " +
                (shown.thumbnail.empty()
                     ? std::string("none")
                     : std::to_string(shown.thumbnail_size.width) + " x " +
                           std::to_string(shown.thumbnail_size.height) + " px, " +
                           std::to_string(shown.thumbnail.size()) + " bytes"));
  const auto tell_all = [&](std::string title, const std::vector<Neighbour>& views) {
    for (const auto& [view, dissimilarity, distance_m, how] : views) {
      title.resize(16, ' ');
      std::string line = title + readable_line(memory.info(view).name);
      if (!how.empty()) line += ", " + how;
      if (dissimilarity) line += ", dissimilarity " + std::to_string(*dissimilarity);
      if (distance_m) line += ", " + fixed(*distance_m, 2) + " m away";
      session.print(line);
      title.clear();
    }
  };
  tell_all("  links to", shown.links);
  tell_all("  most similar", shown.similar);
  tell_all("  nearest", shown.near);
  for (const auto& [map, node, edges] : shown.nodes) {
    session.print("  in " + readable_line(map) + ", component " + std::to_string(node.component) +
                  ": x " + fixed(node.pose.x_m, 2) + ", y " + fixed(node.pose.y_m, 2) + ", " +
                  std::to_string(edges) + " edges");
  }
}

ExitCode show(const ShowArguments& wanted, Session& session) {
  const auto file = MemoryFile::open(wanted.memory, Access::read_only);
  const ViewId view = named_view(file, wanted.view);
  const VisualMemory memory = file.load();
  const Shown shown = gather(file, memory, view);
  if (wanted.thumbnail) {
    if (shown.thumbnail.empty()) {
      throw FileError(wanted.memory, "holds no thumbnail of " + readable_line(wanted.view) +
                                         "; memorise keeps them unless told --no-thumbnails");
    }
    const Image picture = decode_image(shown.thumbnail, "thumbnail");
    write_png(*wanted.thumbnail, picture.view());
  }
  if (session.json()) {
    session.print(json_line(as_json(wanted.memory, shown, memory)));
    return ExitCode::done;
  }
  tell(shown, memory, session);
  if (wanted.thumbnail) session.print("Thumbnail written to " + *wanted.thumbnail);
  return ExitCode::done;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<ShowArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positional("VIEW", wanted->view, "Name or id of a view");
  arguments.option("-o,--thumbnail", wanted->thumbnail, "Write its thumbnail into this PNG file");
  return [wanted](Session& session) { return show(*wanted, session); };
}

}  // namespace

Verb show_verb() {
  return {"show", "Show all that a memory knows of a view",
          "Its pose, links and place in maps, its size, and the five views that are most similar\n"
          "and nearest to it.",
          "  panonav show office.panonav view_00012.png\n"
          "  panonav show office.panonav 13 -o view_13.png",
          declare};
}

}  // namespace panonav::command
