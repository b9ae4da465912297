#include "panonav_simulation/internal/collada_repair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav_simulation/internal/xml.hpp"
#include "panonav_simulation/scene.hpp"

namespace panonav::simulation {

namespace {

bool has_any_name(pugi::xml_node element, std::initializer_list<std::string_view> names) {
  return std::ranges::find(names, std::string_view(element.name())) != names.end();
}

std::vector<pugi::xml_node> list_elements(pugi::xml_node parent) {
  std::vector<pugi::xml_node> elements;
  for (const pugi::xml_node& child : parent) {
    if (child.type() == pugi::node_element) elements.push_back(child);
  }
  return elements;
}

void set_text(pugi::xml_node element, const std::string& text) {
  element.remove_children();
  if (!text.empty()) element.text().set(text.c_str());
}

void set_attribute(pugi::xml_node element, const char* name, const std::string& value) {
  element.remove_attribute(name);
  element.append_attribute(name).set_value(value.c_str());
}

// Returns a whole number >= 0 from an attribute; `otherwise` if it is missing or anything else.
std::size_t read_count(pugi::xml_node element, const char* name, std::size_t otherwise) {
  constexpr double max_count = 1e9;
  const auto numbers = parse_numbers(element.attribute(name).value());
  if (!numbers || numbers->size() != 1) return otherwise;
  const double value = numbers->front();
  return value >= 0.0 && value <= max_count ? static_cast<std::size_t>(value) : otherwise;
}

// Parses numbers; words that are no finite numbers become NaN.
std::vector<double> parse_any_numbers(const std::string& text) {
  if (auto numbers = parse_numbers(text)) return *std::move(numbers);
  std::vector<double> result;
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  for (std::string word; words >> word;) {
    const auto number = parse_numbers(word);
    result.push_back(number && number->size() == 1 ? number->front()
                                                   : std::numeric_limits<double>::quiet_NaN());
  }
  return result;
}

// One corner of a polygon: indices into positions and texture coordinates.
struct PolygonCorner {
  double vertex = 0.0;
  double texture = 0.0;
};
using Outline = std::vector<PolygonCorner>;

// Returns the normal of an outline, with twice its area as length.
Vector3 area_normal(const std::vector<Vector3>& outline) {
  Vector3 sum{};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector3& a = outline[i];
    const Vector3& b = outline[(i + 1) % outline.size()];
    sum.x_m += a.y_m * b.z_m - a.z_m * b.y_m;
    sum.y_m += a.z_m * b.x_m - a.x_m * b.z_m;
    sum.z_m += a.x_m * b.y_m - a.y_m * b.x_m;
  }
  return sum;
}

// Reads the polygons of one primitive element (<triangles>, <polylist>, ...) and writes them again
// with nothing but positions and one set of texture coordinates.
class Primitive {
 public:
  // `positions`: x y z of each vertex. `texture_count`: number of texture coordinates at
  // `texture_source`; 0: none.
  Primitive(pugi::xml_node element, std::vector<double> positions)
      : element_(element), positions_(std::move(positions)) {}

  // The input that holds the vertices, and the one of the lowest set of texture coordinates.
  bool read_inputs() {
    std::size_t lowest_set = std::numeric_limits<std::size_t>::max();
    bool has_vertices = false;
    for (const pugi::xml_node& input : element_.children("input")) {
      const std::size_t offset = read_count(input, "offset", 0);
      if (offset >= max_inputs) return false;
      stride_ = std::max(stride_, offset + 1);
      const std::string_view semantic = input.attribute("semantic").value();
      const std::size_t set = read_count(input, "set", 0);
      if (semantic == "VERTEX") {
        has_vertices = true;
        vertex_offset_ = offset;
        vertex_source_ = input.attribute("source").value();
      } else if (semantic == "TEXCOORD" && set < lowest_set) {
        lowest_set = set;
        texture_offset_ = offset;
        texture_source_ = input.attribute("source").value();
      }
    }
    return has_vertices;
  }

  [[nodiscard]] const std::string& texture_source() const { return texture_source_; }

  void rewrite(std::size_t texture_count) {
    texture_count_ = texture_count;
    const std::vector<Outline> outlines = read_outlines();
    const pugi::xml_attribute material = element_.attribute("material");
    const std::string symbol = material.value();
    element_.remove_children();
    element_.remove_attributes();
    element_.set_name("polylist");
    if (!symbol.empty()) set_attribute(element_, "material", symbol);
    set_attribute(element_, "count", std::to_string(outlines.size()));
    add_input("VERTEX", vertex_source_, 0);
    if (texture_count_ > 0) add_input("TEXCOORD", texture_source_, 1);
    std::string counts;
    std::string indices;
    for (const Outline& outline : outlines) {
      counts += std::to_string(outline.size()) + " ";
      for (const PolygonCorner& corner : outline) {
        indices += std::to_string(std::lround(corner.vertex)) + " ";
        if (texture_count_ > 0) indices += std::to_string(std::lround(corner.texture)) + " ";
      }
    }
    set_text(element_.append_child("vcount"), counts);
    set_text(element_.append_child("p"), indices);
  }

 private:
  static constexpr std::size_t max_inputs = 32;

  void add_input(const char* semantic, const std::string& source, int offset) {
    pugi::xml_node input = element_.append_child("input");
    set_attribute(input, "semantic", semantic);
    set_attribute(input, "source", source);
    set_attribute(input, "offset", std::to_string(offset));
    if (offset > 0) set_attribute(input, "set", "0");
  }

  [[nodiscard]] Outline parse_corners(pugi::xml_node indices_element) const {
    const auto indices = parse_any_numbers(element_text(indices_element));
    Outline corners;
    corners.reserve(indices.size() / stride_);
    for (std::size_t i = 0; i + stride_ <= indices.size(); i += stride_)
      corners.push_back({indices[i + vertex_offset_], indices[i + texture_offset_]});
    return corners;
  }

  // Adds an outline if all its vertices exist; texture coordinates that do not exist become the
  // first one.
  void add(std::vector<Outline>& outlines, Outline outline) const {
    const auto vertices = static_cast<double>(positions_.size() / 3);
    if (outline.size() < 3) return;
    for (PolygonCorner& corner : outline) {
      if (!(corner.vertex >= 0.0 && corner.vertex < vertices)) return;
      if (!(corner.texture >= 0.0 && corner.texture < static_cast<double>(texture_count_)))
        corner.texture = 0.0;
    }
    outlines.push_back(std::move(outline));
  }

  [[nodiscard]] std::vector<Outline> read_outlines() const {
    std::vector<Outline> outlines;
    const bool is_fan = has_any_name(element_, {"trifans"});
    const bool is_strip = has_any_name(element_, {"tristrips"});
    for (const pugi::xml_node& part : element_.children()) {
      if (has_any_name(part, {"ph"})) {
        add_polygon_with_holes(outlines, part);
        continue;
      }
      if (!has_any_name(part, {"p"})) continue;
      const Outline corners = parse_corners(part);
      if (has_any_name(element_, {"polygons"})) {
        add(outlines, corners);
      } else if (is_fan || is_strip) {
        for (std::size_t i = 2; i < corners.size(); ++i) {
          const PolygonCorner& first = is_fan ? corners[0] : corners[i - 2];
          const bool is_flipped = is_strip && i % 2 == 1;
          add(outlines, is_flipped ? Outline{corners[i - 1], first, corners[i]}
                                   : Outline{first, corners[i - 1], corners[i]});
        }
      } else {
        split(outlines, corners);
      }
    }
    return outlines;
  }

  // Splits the corners of <triangles> and <polylist>.
  void split(std::vector<Outline>& outlines, const Outline& corners) const {
    std::vector<double> sizes;
    if (has_any_name(element_, {"polylist"}))
      sizes = parse_any_numbers(element_text(element_.child("vcount")));
    std::size_t at = 0;
    for (std::size_t i = 0; at < corners.size(); ++i) {
      if (!sizes.empty() && i >= sizes.size()) return;
      const double size = sizes.empty() ? 3.0 : sizes[i];
      if (!(size >= 0.0 && size <= static_cast<double>(corners.size() - at))) return;
      const auto next = at + static_cast<std::size_t>(size);
      add(outlines, {corners.begin() + static_cast<std::ptrdiff_t>(at),
                     corners.begin() + static_cast<std::ptrdiff_t>(next)});
      at = next;
    }
  }

  // Adds a polygon with holes as an equivalent one without: each hole is merged into the outline by
  // a cut between the nearest pair of vertices.
  void add_polygon_with_holes(std::vector<Outline>& outlines, pugi::xml_node polygon) const {
    std::vector<Outline> rings;
    add(rings, parse_corners(polygon.child("p")));
    if (rings.empty()) return;
    for (const pugi::xml_node& hole : polygon.children("h")) {
      const std::size_t rings_before = rings.size();
      add(rings, parse_corners(hole));
      if (rings.size() == rings_before)
        return;  // a damaged hole; showing the polygon would hide it
    }
    for (std::size_t i = 1; i < rings.size(); ++i) merge_hole(rings[0], rings[i]);
    outlines.push_back(std::move(rings[0]));
  }

  [[nodiscard]] std::vector<Vector3> find_positions(const Outline& outline) const {
    std::vector<Vector3> result;
    for (const PolygonCorner& corner : outline) {
      const double* p = &positions_[3 * static_cast<std::size_t>(corner.vertex)];
      result.push_back({p[0], p[1], p[2]});
    }
    return result;
  }

  void merge_hole(Outline& outline, Outline hole) const {
    const Vector3 a = area_normal(find_positions(outline));
    const Vector3 b = area_normal(find_positions(hole));
    if (a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m > 0.0) std::reverse(hole.begin(), hole.end());
    constexpr std::size_t max_pairs = 10000000;
    if (outline.size() > max_pairs / hole.size()) throw Error("too many vertices around a hole");
    const std::vector<Vector3> around = find_positions(outline);
    const std::vector<Vector3> inside = find_positions(hole);
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t at_outline = 0;
    std::size_t at_hole = 0;
    for (std::size_t h = 0; h < hole.size(); ++h) {
      const Vector3& q = inside[h];
      for (std::size_t o = 0; o < outline.size(); ++o) {
        const Vector3& p = around[o];
        const double distance = std::hypot(p.x_m - q.x_m, p.y_m - q.y_m, p.z_m - q.z_m);
        if (!(distance < nearest)) continue;
        nearest = distance;
        at_outline = o;
        at_hole = h;
      }
    }
    std::rotate(hole.begin(), hole.begin() + static_cast<std::ptrdiff_t>(at_hole), hole.end());
    hole.push_back(hole.front());
    hole.push_back(outline[at_outline]);
    outline.insert(outline.begin() + static_cast<std::ptrdiff_t>(at_outline) + 1, hole.begin(),
                   hole.end());
  }

  pugi::xml_node element_;
  std::vector<double> positions_;
  std::size_t stride_ = 1;
  std::size_t vertex_offset_ = 0;
  std::size_t texture_offset_ = 0;
  std::size_t texture_count_ = 0;
  std::string vertex_source_;
  std::string texture_source_;
};

class ColladaRepair {
 public:
  explicit ColladaRepair(pugi::xml_node root) {
    for (pugi::xml_node part : list_elements(root)) {
      if (!has_any_name(part, {"asset", "scene", "library_images", "library_effects",
                               "library_materials", "library_geometries", "library_controllers",
                               "library_nodes", "library_visual_scenes"}))
        root.remove_child(part);
    }
    collect(root);
    for (const pugi::xml_node& instance : skins_) replace_skin(instance);
    root.remove_child("library_controllers");
    for (const pugi::xml_node& mesh : meshes_) repair_mesh(mesh);
  }

 private:
  // Lists what has to be changed, and removes what is not used.
  void collect(pugi::xml_node element) {
    if (const pugi::xml_attribute id = element.attribute("id"))
      by_id_.emplace("#" + std::string(id.value()), element);
    if (has_any_name(element, {"instance_controller"})) skins_.push_back(element);
    if (has_any_name(element, {"mesh"})) meshes_.push_back(element);
    const auto children = list_elements(element);
    if (children.empty()) return set_text(element, element_text(element));
    for (const pugi::xml_node& child : children) {
      if (has_any_name(child, {"extra", "instance_camera", "instance_light",
                               "instance_physics_scene", "instance_kinematics_scene"})) {
        element.remove_child(child);
      } else {
        collect(child);
      }
    }
  }

  [[nodiscard]] pugi::xml_node find(const char* url) const {
    const auto found = by_id_.find(url);
    return found == by_id_.end() ? pugi::xml_node() : found->second;
  }

  // Turns an <instance_controller> into an instance of the geometry that it deforms.
  void replace_skin(pugi::xml_node instance) const {
    constexpr int max_controllers = 8;  // a skin of a morph of a geometry: 2
    std::string url = instance.attribute("url").value();
    for (int i = 0; i < max_controllers && has_any_name(find(url.c_str()), {"controller"}); ++i) {
      for (const pugi::xml_node& part : list_elements(find(url.c_str()))) {
        if (has_any_name(part, {"skin", "morph"})) url = part.attribute("source").value();
      }
    }
    if (!has_any_name(find(url.c_str()), {"geometry"})) {
      instance.parent().remove_child(instance);
      return;
    }
    instance.set_name("instance_geometry");
    set_attribute(instance, "url", url);
    while (instance.remove_child("skeleton")) {
    }
  }

  // Returns the source to which the input `semantic` of an element refers.
  [[nodiscard]] pugi::xml_node find_input_source(pugi::xml_node element,
                                                 std::string_view semantic) const {
    for (const pugi::xml_node& input : element.children("input")) {
      if (input.attribute("semantic").value() == semantic)
        return find(input.attribute("source").value());
    }
    return {};
  }

  // Writes the true numbers of values and entries into a <source>, and words that are no numbers as
  // NaN.
  static void repair_source(pugi::xml_node source) {
    const pugi::xml_node array = source.child("float_array");
    if (!array) return;
    const std::string text = element_text(array);
    const std::vector<double> values = parse_any_numbers(text);
    if (!parse_numbers(text)) {
      std::ostringstream written;
      written.imbue(std::locale::classic());
      written.precision(9);
      for (const double value : values) {
        if (std::isnan(value)) {
          written << "nan ";
        } else {
          written << value << ' ';
        }
      }
      set_text(array, written.str());
    }
    set_attribute(array, "count", std::to_string(values.size()));
    const pugi::xml_node accessor = source.child("technique_common").child("accessor");
    const std::size_t stride = std::max<std::size_t>(1, read_count(accessor, "stride", 1));
    const std::size_t offset = read_count(accessor, "offset", 0);
    const std::size_t room = values.size() > offset ? (values.size() - offset) / stride : 0;
    if (!accessor) return;
    set_attribute(accessor, "count",
                  std::to_string(std::min(room, read_count(accessor, "count", room))));
    name_parameters(accessor, stride);
  }

  // Names the values of each entry if the file does not, as its readers in robot simulators allow.
  static void name_parameters(pugi::xml_node accessor, std::size_t stride) {
    for (const pugi::xml_node& parameter : accessor.children("param")) {
      if (!std::string_view(parameter.attribute("name").value()).empty()) return;
    }
    accessor.remove_children();
    constexpr std::array position{"X", "Y", "Z"};
    constexpr std::array texture{"S", "T"};
    for (std::size_t i = 0; i < std::min<std::size_t>(stride, 3); ++i) {
      pugi::xml_node parameter = accessor.append_child("param");
      set_attribute(parameter, "name", stride == 2 ? texture[i] : position[i]);
      set_attribute(parameter, "type", "float");
    }
  }

  [[nodiscard]] static std::size_t count_entries(pugi::xml_node source) {
    return read_count(source.child("technique_common").child("accessor"), "count", 0);
  }

  // Returns x y z of each vertex of a source.
  [[nodiscard]] static std::vector<double> read_positions(pugi::xml_node source) {
    const std::vector<double> values = parse_any_numbers(element_text(source.child("float_array")));
    const pugi::xml_node accessor = source.child("technique_common").child("accessor");
    const std::size_t stride = std::max<std::size_t>(1, read_count(accessor, "stride", 3));
    const std::size_t offset = read_count(accessor, "offset", 0);
    std::vector<double> positions;
    for (std::size_t i = 0; i < count_entries(source); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = offset + i * stride + axis;
        positions.push_back(axis < stride && at < values.size() ? values[at] : 0.0);
      }
    }
    return positions;
  }

  void repair_mesh(pugi::xml_node mesh) const {
    for (const pugi::xml_node& source : mesh.children("source")) repair_source(source);
    std::vector<double> positions;
    for (pugi::xml_node vertices : mesh.children("vertices")) {
      positions = read_positions(find_input_source(vertices, "POSITION"));
      for (const pugi::xml_node& input : list_elements(vertices)) {
        if (std::string_view(input.attribute("semantic").value()) != "POSITION")
          vertices.remove_child(input);
      }
    }
    for (const pugi::xml_node& part : list_elements(mesh)) {
      if (has_any_name(part, {"source", "vertices"})) continue;
      Primitive primitive(part, positions);
      const bool is_surface =
          has_any_name(part, {"triangles", "polylist", "polygons", "trifans", "tristrips"});
      if (!is_surface || positions.empty() || !primitive.read_inputs()) {
        mesh.remove_child(part);
        continue;
      }
      primitive.rewrite(count_entries(find(primitive.texture_source().c_str())));
    }
  }

  std::map<std::string, pugi::xml_node> by_id_;
  std::vector<pugi::xml_node> skins_;
  std::vector<pugi::xml_node> meshes_;
};

}  // namespace

std::string repair_collada(std::string_view text) {
  const pugi::xml_document document = parse_xml(text);
  const ColladaRepair repair(document.document_element());
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  document.save(stream, "", pugi::format_raw | pugi::format_no_declaration);
  return std::move(stream).str();
}

}  // namespace panonav::simulation
