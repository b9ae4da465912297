#include "panonav/pipeline/view_list.hpp"

#include <algorithm>
#include <map>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/mapping/topological_map.hpp"

namespace panonav {

namespace {

std::map<ViewId, std::size_t> find_components(const MemoryFile& file) {
  const auto names = file.map_names();
  if (names.empty()) return {};
  const bool driven = std::ranges::find(names, "map") != names.end();
  const auto map = file.map(driven ? "map" : names.front());
  std::map<ViewId, std::size_t> components;
  for (const TopologicalMap::Node& node : map->nodes) components[node.view] = node.component;
  return components;
}

}  // namespace

std::vector<ViewRecord> list_views(const MemoryFile& file) {
  std::vector<ViewRecord> views;
  file.read_views([&](ViewId view, const ReferenceInfo& info, const PackedSignature&) {
    views.push_back({view, info});
  });
  const auto components = find_components(file);
  const auto pictured = file.views_with_thumbnail();
  std::map<ViewId, std::size_t> links;
  for (const Link& link : file.links()) {
    ++links[link.a];
    ++links[link.b];
  }
  for (ViewRecord& record : views) {
    if (const auto found = links.find(record.view); found != links.end())
      record.links = found->second;
    record.thumbnail = std::ranges::binary_search(pictured, record.view);
    if (const auto found = components.find(record.view); found != components.end())
      record.component = found->second;
  }
  return views;
}

std::string format_view_table(std::span<const ViewRecord> views, LengthUnit unit,
                              std::span<const std::string> pictures) {
  require(pictures.empty() || pictures.size() == views.size(), "pictures",
          static_cast<double>(pictures.size()), "none, or as many as views");
  std::string table = unit == LengthUnit::metres ? "id,name,x_m,y_m" : "id,name,x_steps,y_steps";
  table += ",heading_deg,stamp_s,links,component,thumbnail";
  table += pictures.empty() ? "\n" : ",picture\n";
  const auto add = [&table](const std::string& field) {
    table += ',';
    table += field;
  };
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto& [view, info, links, thumbnail, component] = views[i];
    const auto& pose = info.pose;
    table += std::to_string(view.value);
    add(to_sheet_field(info.name));
    add(pose ? to_text(pose->x_m) : "");
    add(pose ? to_text(pose->y_m) : "");
    add(pose && pose->heading_rad ? to_text(to_exact_degrees(*pose->heading_rad)) : "");
    add(info.stamp_s ? to_text(*info.stamp_s) : "");
    add(std::to_string(links));
    add(component ? std::to_string(*component) : "");
    add(thumbnail ? "1" : "0");
    if (!pictures.empty()) add(pictures[i].empty() ? "" : to_sheet_field(pictures[i]));
    table += '\n';
  }
  return table;
}

std::optional<ViewId> find_view_by_name(const MemoryFile& file, const std::string& name) {
  const auto found = file.find(name);
  return found ? found : file.find(escape_name(name));
}

ViewId find_view_by_name_or_id(const MemoryFile& file, const std::string& name_or_id) {
  if (const auto named = find_view_by_name(file, name_or_id)) return *named;
  std::uint32_t id = 0;
  if (read_number(name_or_id, id) && std::ranges::binary_search(file.views(), ViewId{id})) {
    return ViewId{id};
  }
  const auto names = file.names();
  const auto similar = std::ranges::find_if(
      names, [&](const std::string& name) { return name.starts_with(name_or_id); });
  throw FileError(file.path().string(),
                  "has no view of the name or id '" + name_or_id + "'" +
                      (similar == names.end() ? "; panonav list prints the names and ids"
                                              : "; did you mean '" + *similar + "'?"));
}

}  // namespace panonav
