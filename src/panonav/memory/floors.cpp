#include "panonav/memory/floors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "panonav/core/error.hpp"
#include "panonav/geometry/position_bound.hpp"

namespace panonav {

namespace {

constexpr std::string_view folder_prefix = "floor=";
/// Distance of the origins of two floors in the plane: above twice `max_position_m`, so that floors
/// do not meet, and a power of 2, so that positions lose little precision.
constexpr double pitch_m = 0x1p25;
static_assert(pitch_m > 3.0 * max_position_m);
/// Floors in a row of the plane, which keeps 25 floors within the cells of a particle filter
/// (`ViewLikelihood`) for views 10 cm apart.
constexpr std::size_t floors_in_a_row = 5;

}  // namespace

std::string_view floor_of(std::string_view view_name) noexcept {
  if (!view_name.starts_with(folder_prefix)) return {};
  const std::size_t end = view_name.find('/');
  if (end == std::string_view::npos) return {};
  return view_name.substr(folder_prefix.size(), end - folder_prefix.size());
}

std::string make_name_on_floor(std::string_view floor, std::string_view name) {
  require_floor(floor);
  if (floor.empty()) return std::string(name);
  return std::string(folder_prefix) + std::string(floor) + "/" + std::string(name);
}

std::string add_prefix_on_floor(std::string_view prefix, std::string_view name) {
  const std::size_t begin = floor_of(name).empty() ? 0 : name.find('/') + 1;
  return std::string(name).insert(begin, prefix);
}

void require_floor(std::string_view floor) {
  constexpr std::size_t max_bytes = 200;
  const bool is_readable = std::ranges::none_of(
      floor, [](char c) { return c == '/' || static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
  if (is_readable && floor.size() <= max_bytes) return;
  throw ContractError(
      "floor", "\"" + std::string(floor.substr(0, max_bytes)) + "\"",
      "at most " + std::to_string(max_bytes) + " bytes without a slash and control characters");
}

bool are_on_one_floor(const VisualMemory& memory, ViewId a, ViewId b) {
  return floor_of(memory.info(a).name) == floor_of(memory.info(b).name);
}

std::vector<std::string> list_floors(const VisualMemory& memory) {
  std::set<std::string, std::less<>> floors;
  for (const ViewId view : memory.views()) floors.emplace(floor_of(memory.info(view).name));
  return {floors.begin(), floors.end()};
}

double distance(const FloorPosition& a, const FloorPosition& b) noexcept {
  if (a.floor != b.floor) return std::numeric_limits<double>::infinity();
  return distance(a.point, b.point);
}

std::optional<FloorPosition> find_position(const ReferenceInfo& info) noexcept {
  if (!info.pose) return std::nullopt;
  return FloorPosition{info.pose->position(), floor_of(info.name)};
}

Point2 FloorPlane::to_plane(const FloorPosition& position) {
  auto found = std::ranges::find(floors_, position.floor);
  if (found == floors_.end()) found = floors_.insert(floors_.end(), std::string(position.floor));
  const auto index = static_cast<std::size_t>(found - floors_.begin());
  return {position.point.x_m + pitch_m * static_cast<double>(index % floors_in_a_row),
          position.point.y_m + pitch_m * static_cast<double>(index / floors_in_a_row)};
}

FloorPosition FloorPlane::to_floor(Point2 in_plane) const {
  const auto to_cell = [](double coordinate_m, double last) {
    return std::clamp(std::round(coordinate_m / pitch_m), 0.0, last);
  };
  const double column = to_cell(in_plane.x_m, floors_in_a_row - 1.0);
  const double row = to_cell(in_plane.y_m, static_cast<double>(floors_.size()));
  const auto index =
      static_cast<std::size_t>(row) * floors_in_a_row + static_cast<std::size_t>(column);
  return {{in_plane.x_m - pitch_m * column, in_plane.y_m - pitch_m * row},
          floors_[std::min(index, floors_.size() - 1)]};
}

FloorPlane make_floor_plane(const VisualMemory& memory) {
  FloorPlane plane;
  for (const ViewId view : memory.views()) {
    if (const auto position = find_position(memory.info(view)))
      static_cast<void>(plane.to_plane(*position));
  }
  return plane;
}

}  // namespace panonav
