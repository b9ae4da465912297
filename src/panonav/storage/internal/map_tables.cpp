#include "panonav/storage/internal/map_tables.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/little_endian.hpp"

namespace panonav {

namespace {

// Records of little-endian numbers. Node: view, component, x, y, heading. Edge: a, b, kind, x, y,
// heading, weight.
constexpr std::size_t node_bytes = 2 * 4 + 3 * 8;
constexpr std::size_t edge_bytes = 3 * 4 + 4 * 8;

void append_real(std::vector<std::uint8_t>& bytes, double value) {
  append_little_endian(bytes, std::bit_cast<std::uint64_t>(value));
}

void append_pose(std::vector<std::uint8_t>& bytes, const Pose2& pose) {
  for (const double value : {pose.x_m, pose.y_m, pose.heading_rad}) append_real(bytes, value);
}

/// Reads the fields of records one after the other; the caller has checked the size.
class RecordReader {
 public:
  explicit RecordReader(std::span<const std::uint8_t> bytes) : at_(bytes.data()) {}
  [[nodiscard]] std::uint32_t number() { return next<std::uint32_t>(); }
  [[nodiscard]] double real() { return std::bit_cast<double>(next<std::uint64_t>()); }
  [[nodiscard]] Pose2 pose() {
    const double x_m = real();
    const double y_m = real();
    return {x_m, y_m, real()};
  }

 private:
  template <class Word>
  Word next() {
    const auto word = read_little_endian<Word>(at_);
    at_ += sizeof(Word);
    return word;
  }
  const std::uint8_t* at_;
};

std::int64_t map_checksum(std::string_view name, std::span<const std::uint8_t> nodes,
                          std::span<const std::uint8_t> edges) {
  RecordBytes record;
  record.add(name);
  record.add(nodes);
  record.add(edges);
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

[[noreturn]] void fail_map(const MemoryTables& tables, std::string_view name,
                           const std::string& what) {
  tables.fail_damaged("map " + std::string(name) + ": " + what);
}

}  // namespace

void write_map(MemoryTables& tables, std::string_view name, const TopologicalMap& map) {
  if (name.empty()) throw ContractError("name of a map", "empty", "at least one character");
  validate(map);
  std::vector<std::uint8_t> nodes;
  for (const TopologicalMap::Node& node : map.nodes) {
    append_little_endian(nodes, node.view.value);
    append_little_endian(nodes, static_cast<std::uint32_t>(node.component));
    append_pose(nodes, node.pose);
  }
  std::vector<std::uint8_t> edges;
  for (const TopologicalMap::Edge& edge : map.edges) {
    append_little_endian(edges, edge.a.value);
    append_little_endian(edges, edge.b.value);
    append_little_endian(edges, static_cast<std::uint32_t>(edge.kind));
    append_pose(edges, edge.a_from_b);
    append_real(edges, edge.weight);
  }
  const std::int64_t row_checksum = map_checksum(name, nodes, edges);
  tables.write_map(name, {std::move(nodes), std::move(edges), row_checksum});
}

std::optional<TopologicalMap> read_map(MemoryTables& tables, std::string_view name) {
  const auto row = tables.map(name);
  if (!row) return std::nullopt;
  const auto& [nodes, edges, row_checksum] = *row;
  if (nodes.size() % node_bytes != 0 || edges.size() % edge_bytes != 0 ||
      row_checksum != map_checksum(name, nodes, edges)) {
    fail_map(tables, name, "does not match its checksum");
  }
  TopologicalMap map;
  RecordReader node_reader(nodes);
  for (std::size_t i = 0; i < nodes.size() / node_bytes; ++i) {
    TopologicalMap::Node node;
    node.view.value = node_reader.number();
    node.component = node_reader.number();
    node.pose = node_reader.pose();
    map.nodes.push_back(node);
  }
  RecordReader edge_reader(edges);
  for (std::size_t i = 0; i < edges.size() / edge_bytes; ++i) {
    TopologicalMap::Edge edge;
    edge.a.value = edge_reader.number();
    edge.b.value = edge_reader.number();
    const std::uint32_t kind = edge_reader.number();
    if (kind > static_cast<std::uint32_t>(Link::Kind::closure)) {
      fail_map(tables, name, "an edge of kind " + std::to_string(kind) + "; allowed: 0 .. 2");
    }
    edge.kind = static_cast<Link::Kind>(kind);
    edge.a_from_b = edge_reader.pose();
    edge.weight = edge_reader.real();
    map.edges.push_back(edge);
  }
  try {
    validate(map);
  } catch (const ContractError& error) {
    fail_map(tables, name, error.what());
  }
  return map;
}

bool erase_map(MemoryTables& tables, std::string_view name) {
  const bool there = read_map(tables, name).has_value();
  tables.erase_map(name);
  return there;
}

bool remove_views_from_map(TopologicalMap& map, const std::set<ViewId>& forgotten) {
  const auto nodes = std::erase_if(
      map.nodes, [&](const TopologicalMap::Node& node) { return forgotten.contains(node.view); });
  if (nodes == 0) return false;
  std::erase_if(map.edges, [&](const TopologicalMap::Edge& edge) {
    return forgotten.contains(edge.a) || forgotten.contains(edge.b);
  });
  renumber_components(map);
  return true;
}

void erase_views_from_maps(MemoryTables& tables, std::span<const ViewId> views) {
  const std::set<ViewId> forgotten(views.begin(), views.end());
  for (const std::string& name : tables.map_names()) {
    auto map = read_map(tables, name);
    if (map && remove_views_from_map(*map, forgotten)) write_map(tables, name, *map);
  }
}

void verify_maps(MemoryTables& tables, const std::function<bool(ViewId)>& known,
                 const std::function<void(const std::function<void()>&)>& check) {
  std::vector<std::string> names;
  check([&] { names = tables.map_names(); });
  for (const std::string& name : names) {
    check([&] {
      const auto map = read_map(tables, name);
      for (const TopologicalMap::Node& node : map.value().nodes) {
        if (!known(node.view)) {
          fail_map(tables, name,
                   "view " + std::to_string(node.view.value) + " is not in the memory");
        }
      }
    });
  }
}

}  // namespace panonav
