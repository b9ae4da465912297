#include "panonav/storage/internal/map_tables.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

// Records of little-endian numbers: view, component, x, y, heading; and a, b, kind, x, y, heading,
// weight.
constexpr std::size_t node_bytes = 2 * 4 + 3 * 8;
constexpr std::size_t edge_bytes = 3 * 4 + 4 * 8;

template <class Word>
void append_word(std::vector<std::uint8_t>& bytes, Word word) {
  for (std::size_t shift = 0; shift < 8 * sizeof(Word); shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>((word >> shift) & 255U));
  }
}

void append_real(std::vector<std::uint8_t>& bytes, double value) {
  append_word(bytes, std::bit_cast<std::uint64_t>(value));
}

void append_pose(std::vector<std::uint8_t>& bytes, const Pose2& pose) {
  append_real(bytes, pose.x_m);
  append_real(bytes, pose.y_m);
  append_real(bytes, pose.heading_rad);
}

/// Reads what `append_*` wrote.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint32_t number() { return static_cast<std::uint32_t>(word(4)); }
  [[nodiscard]] double real() { return std::bit_cast<double>(word(8)); }
  [[nodiscard]] Pose2 pose() {
    const double x_m = real();
    const double y_m = real();
    return {x_m, y_m, real()};
  }

 private:
  std::uint64_t word(std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{bytes_[at_ + i]} << (8 * i);
    at_ += size;
    return value;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
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
  for (const MapNode& node : map.nodes) {
    append_word(nodes, node.view.value);
    append_word(nodes, static_cast<std::uint32_t>(node.component));
    append_pose(nodes, node.pose);
  }
  std::vector<std::uint8_t> edges;
  for (const MapEdge& edge : map.edges) {
    append_word(edges, edge.a.value);
    append_word(edges, edge.b.value);
    append_word(edges, static_cast<std::uint32_t>(edge.kind));
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
  Reader node_reader(nodes);
  for (std::size_t i = 0; i < nodes.size() / node_bytes; ++i) {
    MapNode node;
    node.view.value = node_reader.number();
    node.component = node_reader.number();
    node.pose = node_reader.pose();
    map.nodes.push_back(node);
  }
  Reader edge_reader(edges);
  for (std::size_t i = 0; i < edges.size() / edge_bytes; ++i) {
    MapEdge edge;
    edge.a.value = edge_reader.number();
    edge.b.value = edge_reader.number();
    const std::uint32_t kind = edge_reader.number();
    if (kind > static_cast<std::uint32_t>(LinkKind::closure)) {
      fail_map(tables, name, "an edge of kind " + std::to_string(kind) + "; allowed: 0 .. 2");
    }
    edge.kind = static_cast<LinkKind>(kind);
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

void forget_in_maps(MemoryTables& tables, std::span<const ViewId> views) {
  const std::set<ViewId> forgotten(views.begin(), views.end());
  for (const std::string& name : tables.map_names()) {
    auto map = read_map(tables, name);
    if (!map) continue;
    const auto nodes = std::erase_if(
        map->nodes, [&](const MapNode& node) { return forgotten.contains(node.view); });
    if (nodes == 0) continue;
    std::erase_if(map->edges, [&](const MapEdge& edge) {
      return forgotten.contains(edge.a) || forgotten.contains(edge.b);
    });
    renumber_components(*map);
    write_map(tables, name, *map);
  }
}

void verify_maps(MemoryTables& tables, const std::function<bool(ViewId)>& known,
                 const std::function<void(const std::function<void()>&)>& check) {
  std::vector<std::string> names;
  check([&] { names = tables.map_names(); });
  for (const std::string& name : names) {
    check([&] {
      const auto map = read_map(tables, name);
      for (const MapNode& node : map.value().nodes) {
        if (!known(node.view)) {
          fail_map(tables, name,
                   "view " + std::to_string(node.view.value) + " is not in the memory");
        }
      }
    });
  }
}

}  // namespace panonav
