#include "panonav/pipeline/graph_file.hpp"

#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav {

namespace {

std::string_view to_string(Link::Kind kind) {
  switch (kind) {
    case Link::Kind::sequence:
      return "sequence";
    case Link::Kind::neighbour:
      return "neighbour";
    case Link::Kind::closure:
      return "closure";
  }
  return "";
}

std::string escape_xml(std::string_view text) {
  std::string safe;
  for (const char c : to_readable_line(text)) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string format_data(std::string_view key, std::string_view value) {
  return "<data key=\"" + std::string(key) + "\">" + std::string(value) + "</data>";
}

std::string format_pose(const Pose2& pose) {
  return format_data("x_m", to_text(pose.x_m)) + format_data("y_m", to_text(pose.y_m)) +
         format_data("heading_rad", to_text(pose.heading_rad));
}

}  // namespace

void write_graph(const std::filesystem::path& path, const TopologicalMap& map,
                 const std::function<std::string(ViewId)>& name) {
  validate(map);
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n";
  for (const std::string key : {"x_m", "y_m", "heading_rad"}) {
    text +=
        "<key id=\"" + key + "\" for=\"all\" attr.name=\"" + key + "\" attr.type=\"double\"/>\n";
  }
  text +=
      "<key id=\"name\" for=\"node\" attr.name=\"name\" attr.type=\"string\"/>\n"
      "<key id=\"component\" for=\"node\" attr.name=\"component\" attr.type=\"long\"/>\n"
      "<key id=\"kind\" for=\"edge\" attr.name=\"kind\" attr.type=\"string\"/>\n"
      "<key id=\"weight\" for=\"edge\" attr.name=\"weight\" attr.type=\"double\"/>\n"
      "<graph edgedefault=\"directed\">\n";
  for (const TopologicalMap::Node& node : map.nodes) {
    text += "<node id=\"" + std::to_string(node.view.value) + "\">" +
            format_data("name", escape_xml(name(node.view))) + format_pose(node.pose) +
            format_data("component", std::to_string(node.component)) + "</node>\n";
  }
  for (const TopologicalMap::Edge& edge : map.edges) {
    text += "<edge source=\"" + std::to_string(edge.a.value) + "\" target=\"" +
            std::to_string(edge.b.value) + "\">" + format_data("kind", to_string(edge.kind)) +
            format_data("weight", to_text(edge.weight)) + format_pose(edge.a_from_b) + "</edge>\n";
  }
  text += "</graph>\n</graphml>\n";
  write_file(path, text);
}

}  // namespace panonav
